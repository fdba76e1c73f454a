"""Striking a ball: flight, estimation, contact, reach, choice of a hit, and learning. Arrays in, arrays out."""
