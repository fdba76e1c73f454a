"""Which pairs of bodies plans are checked for, and their distances."""

from pathlib import Path

import numpy as np
import pytest

from robot.clearance import Clearance, Ignored
from tests.unit.robot.small_arm import MODEL, small_arm

EAST = [0.0, 0.0, 0.0]
BLOCK = '</body><body name="block" mocap="true" pos="0.5 0.5 0">'
"""Ends a base that is wrapped around the arm, and begins what stood there as the ball."""


def made(folder: Path, more: str = "", **fields: str) -> Clearance:
    config = small_arm(folder, more, **fields)
    return Clearance(config, config.load_model())


def pairs(clearance: Clearance) -> set[tuple[str, str]]:
    return {pair.bodies for pair in clearance.pairs}


def test_what_flies_or_is_moved_by_hand_does_not_count(tmp_path: Path):
    clearance = made(tmp_path)
    assert pairs(clearance) == {
        ("lower", "wall"),
        ("lower", "pedestal"),
        ("upper", "wall"),
        ("hand", "wall"),
        ("hand", "pedestal"),
        ("hand", "upper"),
        ("finger", "wall"),
        ("finger", "pedestal"),
        ("finger", "upper"),
        ("finger", "lower"),
    }


def test_what_stands_on_a_mocap_body_counts(tmp_path: Path):
    """A base that is a mocap body carries the arm; a body that somebody may move stands where the model has it."""
    on_the_world = pairs(made(tmp_path))
    model = MODEL.replace('<body name="upper">', '<body name="base" mocap="true"><body name="upper">')
    model = model.replace('<body name="ball" pos="0.5 0.5 0"><freejoint/>', BLOCK)
    found = pairs(made(tmp_path, model=model))
    assert found - on_the_world == {(body, "block") for body in ("upper", "lower", "hand", "finger")}
    assert on_the_world <= found


def test_what_is_ignored_is_listed_with_its_reason(tmp_path: Path):
    clearance = made(tmp_path, '[collision]\nignore = [["finger", "world"]]')
    assert set(clearance.ignored) == {
        Ignored("lower", "upper", "neighbours"),
        Ignored("hand", "lower", "neighbours"),
        Ignored("upper", "pedestal", "near at home"),
        Ignored("finger", "wall", "collision.ignore"),
        Ignored("finger", "pedestal", "collision.ignore"),
    }
    assert ("upper", "wall") in pairs(clearance), "of the world each geom counts alone"
    assert not {pair for pair in pairs(clearance) if pair[0] == "finger" and pair[1] in ("wall", "pedestal")}
    assert "near at home: upper – pedestal" in str(clearance)


def test_what_is_near_at_home_may_touch(tmp_path: Path):
    folded = made(tmp_path, home="[1.57, 3.05, 0.0]")
    assert Ignored("hand", "upper", "near at home") in folded.ignored
    assert ("hand", "upper") not in pairs(folded)


def test_distances_are_exact_where_they_are_small(tmp_path: Path):
    clearance = made(tmp_path)
    clearance.place(np.array(EAST))
    hand = [pair.bodies for pair in clearance.pairs].index(("hand", "wall"))
    assert clearance.distance(hand) == pytest.approx(1.9 - 1.74, abs=1e-6)
    clearance.place(np.array([0.0, np.pi, 0.0]))
    assert clearance.distance(hand) >= 0.2, "a lower bound"


def test_held_joints_are_at_their_values(tmp_path: Path):
    distances = []
    for value in (0.0, 0.3):
        clearance = made(tmp_path, f"[held]\ngrip = {value}\n")
        clearance.place(np.array([0.0, 0.0, np.pi / 2]))
        index = next(i for i, pair in enumerate(clearance.pairs) if pair.bodies == ("finger", "lower"))
        distances.append(clearance.distance(index))
    assert distances[0] == pytest.approx(0.13, abs=1e-6)
    assert distances[1] > distances[0]


def test_what_has_no_true_distance_does_not_count(tmp_path: Path):
    model = MODEL.replace(
        "<worldbody>", '<asset><hfield name="h" nrow="4" ncol="4" size="2 2 1 1"/></asset><worldbody>'
    )
    hills = model.replace('<geom name="pedestal"', '<geom name="hills" type="hfield" hfield="h"/><geom name="pedestal"')
    assert pairs(made(tmp_path, model=hills)) == pairs(made(tmp_path))


def test_the_body_that_the_arm_moves_is_named_first(tmp_path: Path):
    """Also where what it meets stands after it in the model."""
    clearance = made(tmp_path, model=MODEL.replace("<freejoint/>", ""))
    assert ("lower", "ball") in pairs(clearance)
    assert all("ball" not in one for one, _ in pairs(clearance))
