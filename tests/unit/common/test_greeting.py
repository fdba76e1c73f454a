"""The next steps that `volley up` prints, for the shipped robot and for others."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from msgspec.structs import replace

from protocol import messages as m
from protocol.bus.sessions import DEFAULT_ENDPOINT
from services.__main__ import first_command, flags_for
from services.common.cli import Options
from tests.golden.examples import EXAMPLES
from tests.stub import Stub, answering, hosted

ENTRY = m.PrimitiveEntry(name="wave", joint_count=1, duration=1.0, samples=10, created=0.0, joint_names=["lift"])


@pytest.fixture(scope="module")
def robot() -> Iterator[Stub]:
    """Return a robot with the joints of the golden description."""
    with hosted() as router, answering(router) as stub:
        yield stub


def test_flags_stand_only_where_the_defaults_are_anothers(tmp_path: Path):
    assert flags_for(Options(), DEFAULT_ENDPOINT) == ""
    assert flags_for(Options(), "tcp/127.0.0.1:7448") == " --connect tcp/127.0.0.1:7448"
    assert flags_for(Options(robot="left"), DEFAULT_ENDPOINT) == " --robot left"


def test_a_primitive_that_this_arm_can_play_is_named(robot: Stub):
    """Primitives of other arms, which the library may list, are not named."""
    own = EXAMPLES["Primitives"]
    assert isinstance(own, m.Primitives)
    robot.answers["primitives"] = [own, replace(own, primitives=[ENTRY, *own.primitives])]
    assert [first_command(robot.bus, " --robot left") for _ in range(2)] == [
        "volley goal forehand --wait --robot left"
    ] * 2


def test_an_arm_without_primitives_is_taught_one(robot: Stub):
    robot.answers["primitives"] = [m.Primitives(primitives=[ENTRY])]
    assert first_command(robot.bus, "") == "volley learn RECORDING --name NAME, then volley goal NAME --wait"
