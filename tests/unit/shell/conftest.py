"""The stub robot for tests of commands."""

from tests.stub import robot, router

__all__ = ["robot", "router"]
