"""The scenarios of the drill, one module a family."""
