"""A robot cell on a network: a permission table, and the Zenoh configurations and certificates made from it."""
