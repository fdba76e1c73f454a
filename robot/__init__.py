"""The robot: its description, its kinematics, and conversions between `motion` and `protocol`."""
