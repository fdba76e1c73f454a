"""The shell command: every request of the wire contract, and a live screen."""
