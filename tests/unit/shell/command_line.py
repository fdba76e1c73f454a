"""Run command lines in this process, against the stub robot."""

from tests.golden.values import HIT
from tests.stub import Stub
from tools.shell.__main__ import main

WORDS = [f"{value}" for value in HIT]


def volley(robot: Stub, *words: str) -> int:
    """Run a command line against the stub."""
    return main([*words, "--connect", robot.endpoint])
