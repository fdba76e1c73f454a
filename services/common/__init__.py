"""What the services share: real-time behaviour, logs, command lines, their place on the bus."""
