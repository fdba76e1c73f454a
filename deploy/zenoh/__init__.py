"""A robot cell on a network: who may do what, as data, and the Zenoh configurations and certificates made from it."""
