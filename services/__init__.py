"""The processes. Each package composes `motion` and `protocol`; none imports another."""
