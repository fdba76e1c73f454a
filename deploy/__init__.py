"""Robots, demonstrations, bus configurations, systemd units and the table of processes."""
