"""Fixtures for tests of the striker without a bus."""

import logging

import pytest
from test_striker_core import LIBRARY, ROBOT, FakeLink

from services.striker.core import Striker
from services.striker.hit_planner import HitPlanner


@pytest.fixture(scope="session")
def hit_planner(tmp_path_factory: pytest.TempPathFactory) -> HitPlanner:
    return HitPlanner(ROBOT, tmp_path_factory.mktemp("striker") / "arm.json", logging.getLogger("striker"))


@pytest.fixture
def link() -> FakeLink:
    return FakeLink()


@pytest.fixture
def striker(hit_planner: HitPlanner, link: FakeLink) -> Striker:
    hit_planner.estimator.reset()
    return Striker(ROBOT, hit_planner, link, LIBRARY, logging.getLogger("striker"))
