"""Robot cells for scenarios: start, observe and disturb them."""
