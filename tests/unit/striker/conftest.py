"""Fixtures for tests of the striker without a bus."""

import logging

import pytest
from test_striker_core import LIBRARY, ROBOT, FakeOutside

from services.striker.core import Striker
from services.striker.mind import Mind


@pytest.fixture(scope="session")
def mind(tmp_path_factory: pytest.TempPathFactory) -> Mind:
    return Mind(ROBOT, tmp_path_factory.mktemp("striker") / "arm.json", logging.getLogger("striker"))


@pytest.fixture
def outside() -> FakeOutside:
    return FakeOutside()


@pytest.fixture
def striker(mind: Mind, outside: FakeOutside) -> Striker:
    mind.estimator.reset()
    return Striker(ROBOT, mind, outside, LIBRARY, logging.getLogger("striker"))
