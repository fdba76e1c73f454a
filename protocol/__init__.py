"""The wire contract as data: topics, messages, codec, and the bus that carries them."""
