"""Balls returned in the table tennis scene of fancy_gym, an independent environment."""
