"""The robot: its description, kinematics, checks, and conversions between `motion` and `protocol`."""
