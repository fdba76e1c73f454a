"""The shell's way to the bus: every request of the wire contract, and a live screen."""
