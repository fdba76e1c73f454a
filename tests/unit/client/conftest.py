"""The stub that the client's tests speak to."""

from collections.abc import Iterator

import pytest

from client import Arm, connect
from tests.stub import Router, Stub, answering, hosted


@pytest.fixture(scope="module")
def router() -> Iterator[Router]:
    with hosted() as router:
        yield router


@pytest.fixture
def robot(router: Router) -> Iterator[Stub]:
    with answering(router) as stub:
        yield stub


@pytest.fixture
def arm(robot: Stub) -> Iterator[Arm]:
    with connect(robot.endpoint) as arm:
        yield arm
