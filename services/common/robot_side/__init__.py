"""The robot side of a bus: the loop that publishes states, applies commands and brakes on silence.

A robot, simulated or real, is a `Backend` that the loop drives; `examples/stand_in_driver.py` is the shortest one.
"""
