"""The stub that the client's tests speak to."""

from collections.abc import Iterator

import pytest

from client import Arm, connect
from tests.stub import Hub, Stub, answering, hosted


@pytest.fixture(scope="module")
def hub() -> Iterator[Hub]:
    with hosted() as hub:
        yield hub


@pytest.fixture
def robot(hub: Hub) -> Iterator[Stub]:
    with answering(hub) as stub:
        yield stub


@pytest.fixture
def arm(robot: Stub) -> Iterator[Arm]:
    with connect(robot.endpoint) as arm:
        yield arm
