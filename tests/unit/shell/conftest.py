"""The stub that the commands speak to."""

from tests.stub import robot, router

__all__ = ["robot", "router"]
