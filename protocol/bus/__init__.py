"""The wire contract over Zenoh: sessions, queues and the bus."""
