"""A robot's TOML, written from its model file."""
