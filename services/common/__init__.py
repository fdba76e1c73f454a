"""Shared by the services: real-time scheduling, logs, command lines, single instances on the bus."""
