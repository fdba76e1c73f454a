"""Mathematics of striking a ball: flight, estimation, contact, reach, choice of a hit, learning. Arrays in and out."""
