"""The simulated arm, and its process on the bus."""
