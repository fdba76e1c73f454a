"""Thirteen mistakes in a model: import or check reports each with a sentence that names a remedy."""

from collections.abc import Callable
from pathlib import Path

import pytest

from robot.checking.checks import check_robot
from robot.description import load_robot
from robot.importing.arm import import_robot
from robot.schema import RobotError
from tests import models

Change = Callable[[str], str]
ELBOW = '<joint name="elbow_joint" type="revolute">'
ELBOW_LIMITS = (
    'effort="150.0" lower="-3.141592653589793" upper="3.141592653589793"\n               velocity="3.141592653589793"'
)


def swap(old: str, new: str) -> Change:
    """Return a function that replaces `old`, which must occur, by `new`."""

    def change(text: str) -> str:
        assert old in text
        return text.replace(old, new)

    return change


def reverse_names(text: str) -> str:
    """Exchange the first two names of the TOML."""
    return swap('"shoulder_pan_joint", "shoulder_lift_joint"', '"shoulder_lift_joint", "shoulder_pan_joint"')(text)


def same(text: str) -> str:
    return text


MUTATIONS: dict[str, tuple[Path, Change, Change, str]] = {
    "degrees": (
        models.UR5E_URDF,
        swap('lower="-3.141592653589793" upper="3.141592653589793"', 'lower="-180" upper="180"'),
        same,
        "elbow_joint: its range of -180 to 180 rad looks like degrees, which are -3.14 to 3.14 rad; a URDF",
    ),
    "order": (models.UR5E_URDF, same, reverse_names, "write the names from the base to the tool"),
    "mimic": (
        models.UR5E_URDF,
        swap(ELBOW, f'{ELBOW}<mimic joint="shoulder_lift_joint" multiplier="-1"/>'),
        same,
        "elbow_joint follows shoulder_lift_joint and cannot move by itself; remove <mimic>",
    ),
    "unlimited": (
        models.UR5E_URDF,
        swap(ELBOW, ELBOW.replace("revolute", "continuous")),
        same,
        "no range of elbow_joint is known, so none is kept; write joints.positions",
    ),
    "swapped range": (
        models.UR5E_URDF,
        swap('lower="-3.141592653589793" upper="3.141592653589793"', 'lower="3.14" upper="-3.14"'),
        same,
        "elbow_joint: its range begins at 3.14 and ends at -3.14; exchange lower and upper",
    ),
    "rounding": (
        models.UR5E,
        swap("-1.5708 -1.5708 1.5708 -1.5708 -1.5708 0", "-1.5708 -1.5708 3.14159265 -1.5708 -1.5708 0"),
        same,
        "elbow_joint: keyframe 'home' has 3.14159, outside of its range; home has 3.1415",
    ),
    "zero velocity": (
        models.UR5E_URDF,
        swap(ELBOW_LIMITS, ELBOW_LIMITS.replace('velocity="3.141592653589793"', 'velocity="0"')),
        same,
        "elbow_joint: velocity is 0, which is taken for unknown; write the true limit",
    ),
    "no effort": (
        models.UR5E_URDF,
        swap(ELBOW_LIMITS, ELBOW_LIMITS.replace('effort="150.0" ', "")),
        same,
        "no torque limit of elbow_joint is known, so none is kept; write joints.torques",
    ),
    "free base": (
        models.UR5E_URDF,
        swap('<joint name="base_link-base_link_inertia" type="fixed">', '<joint name="base" type="floating">'),
        same,
        'base_link_inertia floats freely: base is floating; an arm stands still, write type="fixed"',
    ),
    "duplicate names": (
        models.UR5E_URDF,
        swap('<joint name="wrist_2_joint" type="revolute">', '<joint name="wrist_1_joint" type="revolute">'),
        same,
        "the name 'wrist_1_joint' is repeated; give each joint a name of its own",
    ),
    "fixed joint": (
        models.UR5E_URDF,
        swap(ELBOW, ELBOW.replace("revolute", "fixed")),
        same,
        'elbow_joint is fixed, but has limits; if it should move, write type="revolute"',
    ),
    "equal ends": (
        models.UR5E_URDF,
        swap('lower="-3.141592653589793" upper="3.141592653589793"', 'lower="-1" upper="-1"'),
        same,
        "elbow_joint: its range begins and ends at -1, which is taken for no range; write lower and upper",
    ),
    "negative sentinel": (
        models.UR5E_URDF,
        swap(ELBOW_LIMITS, ELBOW_LIMITS.replace('effort="150.0"', 'effort="-1"')),
        same,
        "elbow_joint: effort is -1, which is taken for unknown; write the true limit",
    ),
}
"""For each mistake the model, the change of the model, the change of its TOML, and the sentence reported."""


@pytest.mark.parametrize("name", MUTATIONS)
def test_a_mistake_in_the_model_is_reported(tmp_path: Path, name: str) -> None:
    source, change_model, change_toml, sentence = MUTATIONS[name]
    for folder in ("collision", "assets"):
        (tmp_path / folder).symlink_to(source.parent / folder)
    file = tmp_path / source.name
    file.write_text(change_model(source.read_text()))
    said = report(file, tmp_path / "robot.toml", change_toml)
    assert any(sentence in line for line in said), said
    assert all("\n" not in line for line in said)


@pytest.mark.parametrize("source", [models.UR5E_URDF, models.UR5E])
def test_a_sound_model_has_no_reports(tmp_path: Path, source: Path) -> None:
    assert [line for line in report(source, tmp_path / "robot.toml", same) if "--tool may name" not in line] == []


def report(source: Path, toml: Path, change_toml: Change) -> list[str]:
    """Return all sentences of import and check, or of the refusal."""
    try:
        imported = import_robot(source, toml)
        toml.write_text(change_toml(imported.text))
        config = load_robot(toml)
    except RobotError as error:
        return [str(error)]
    return [*imported.notes, *(finding.sentence for finding in check_robot(config, config.load_model()))]
