"""Pairs of bodies that plans are checked for, and their distances."""

from pathlib import Path

import numpy as np
import pytest

from robot.clearance import Clearance, Ignored
from tests.unit.robot.small_arm import MODEL, small_arm

EAST = [0.0, 0.0, 0.0]
BLOCK = '</body><body name="block" mocap="true" pos="0.5 0.5 0">'
"""Closes a body wrapped around the arm and replaces the ball by a mocap body."""


def made(folder: Path, more: str = "", **fields: str) -> Clearance:
    config = small_arm(folder, more, **fields)
    return Clearance(config, config.load_model())


def pairs(clearance: Clearance) -> set[tuple[str, str]]:
    return {pair.bodies for pair in clearance.pairs}


def test_free_and_mocap_bodies_are_not_checked(tmp_path: Path):
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


def test_a_mocap_base_of_the_arm_does_not_exempt_its_bodies(tmp_path: Path):
    """With a mocap base, other mocap bodies are checked too, at their poses in the model."""
    on_the_world = pairs(made(tmp_path))
    model = MODEL.replace('<body name="upper">', '<body name="base" mocap="true"><body name="upper">')
    model = model.replace('<body name="ball" pos="0.5 0.5 0"><freejoint/>', BLOCK)
    found = pairs(made(tmp_path, model=model))
    assert found - on_the_world == {(body, "block") for body in ("upper", "lower", "hand", "finger")}
    assert on_the_world <= found


def test_ignored_pairs_are_listed_with_their_reason(tmp_path: Path):
    clearance = made(tmp_path, '[collision]\nignore = [["finger", "world"]]')
    assert set(clearance.ignored) == {
        Ignored("lower", "upper", "neighbours"),
        Ignored("hand", "lower", "neighbours"),
        Ignored("upper", "pedestal", "near at home"),
        Ignored("finger", "wall", "collision.ignore"),
        Ignored("finger", "pedestal", "collision.ignore"),
    }
    assert ("upper", "wall") in pairs(clearance), "each geom of the world is checked separately"
    assert not {pair for pair in pairs(clearance) if pair[0] == "finger" and pair[1] in ("wall", "pedestal")}
    assert "near at home: upper – pedestal" in str(clearance)


def test_a_pair_that_is_near_at_home_is_ignored(tmp_path: Path):
    folded = made(tmp_path, home="[1.57, 3.05, 0.0]")
    assert Ignored("hand", "upper", "near at home") in folded.ignored
    assert ("hand", "upper") not in pairs(folded)


def test_small_distances_are_exact_and_large_ones_lower_bounds(tmp_path: Path):
    clearance = made(tmp_path)
    clearance.place(np.array(EAST))
    hand = [pair.bodies for pair in clearance.pairs].index(("hand", "wall"))
    assert clearance.distance(hand) == pytest.approx(1.9 - 1.74, abs=1e-6)
    clearance.place(np.array([0.0, np.pi, 0.0]))
    assert clearance.distance(hand) >= 0.2, "a lower bound"


def test_held_joints_are_placed_at_their_values(tmp_path: Path):
    distances = []
    for value in (0.0, 0.3):
        clearance = made(tmp_path, f"[held]\ngrip = {value}\n")
        clearance.place(np.array([0.0, 0.0, np.pi / 2]))
        index = next(i for i, pair in enumerate(clearance.pairs) if pair.bodies == ("finger", "lower"))
        distances.append(clearance.distance(index))
    assert distances[0] == pytest.approx(0.13, abs=1e-6)
    assert distances[1] > distances[0]


def test_height_fields_are_not_checked(tmp_path: Path):
    model = MODEL.replace(
        "<worldbody>", '<asset><hfield name="h" nrow="4" ncol="4" size="2 2 1 1"/></asset><worldbody>'
    )
    hills = model.replace('<geom name="pedestal"', '<geom name="hills" type="hfield" hfield="h"/><geom name="pedestal"')
    assert pairs(made(tmp_path, model=hills)) == pairs(made(tmp_path))


def test_a_pair_names_the_arms_body_first(tmp_path: Path):
    """Even if the other body comes later in the model."""
    clearance = made(tmp_path, model=MODEL.replace("<freejoint/>", ""))
    assert ("lower", "ball") in pairs(clearance)
    assert all("ball" not in one for one, _ in pairs(clearance))
