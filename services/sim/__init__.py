"""The simulated arm and its place on the bus."""
