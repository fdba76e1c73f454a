"""Write a robot's TOML from its model file."""
