"""Balls returned on the table tennis scene of fancy_gym, which nobody of this project made."""
