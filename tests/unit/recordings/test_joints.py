"""Matching columns to joints by the names that other programs write."""

import pytest

from tools.recordings.joints import Mismatch, match

ARM = "joint_1", "joint_2", "joint_3"
UR = "shoulder_pan_joint", "shoulder_lift_joint", "elbow_joint", "wrist_1_joint", "wrist_2_joint", "wrist_3_joint"
LEROBOT = "shoulder_pan", "shoulder_lift", "elbow_flex", "wrist_flex", "wrist_roll", "gripper"

NAMED = {
    "the same": (ARM, ARM, (0, 1, 2)),
    "another order": (("joint_3", "joint_1", "joint_2"), ARM, (1, 2, 0)),
    "a robot's prefix": (("panda_joint1", "panda_joint2", "panda_joint3"), ARM, (0, 1, 2)),
    "a robot's prefix in the joints": (ARM, ("panda_joint1", "panda_joint2", "panda_joint3"), (0, 1, 2)),
    "a namespace": (("left/Joint1", "left/Joint3", "left/Joint2"), ARM, (0, 2, 1)),
    "letters": (("q3", "q2", "q1"), ARM, (2, 1, 0)),
    "axes": (("axis-1", "axis-2", "axis-3"), ARM, (0, 1, 2)),
    "zeros before": (("j01", "j02", "j03"), ARM, (0, 1, 2)),
    "from zero": (("q_2", "q_1", "q_0"), ARM, (2, 1, 0)),
    "units": (("joint_1 [deg]", "joint_2 [deg]", "joint_3 [deg]"), ARM, (0, 1, 2)),
    "velocities beside": (("q1", "dq1", "q2", "dq2", "q3", "dq3", "tau1", "tau2", "tau3"), ARM, (0, 2, 4)),
    "PlotJuggler": (
        tuple(f"/joint_states/{joint}/{kind}" for joint in ARM for kind in ("position", "velocity")),
        ARM,
        (0, 2, 4),
    ),
    "LeRobot": (tuple(f"{joint}.pos" for joint in LEROBOT), LEROBOT, tuple(range(6))),
    "LeRobot on a URDF": (tuple(f"{j}.pos" for j in LEROBOT), tuple(f"{j}_joint" for j in LEROBOT), tuple(range(6))),
    "the elbow first": ((UR[2], UR[1], UR[0], *UR[3:]), UR, (2, 1, 0, 3, 4, 5)),
    "UR's targets beside": (tuple(f"{kind}_q_{k}" for kind in ("target", "actual") for k in (0, 1, 2)), ARM, (3, 4, 5)),
}
"""For each case the columns, the joints, and the column index of each joint."""


@pytest.mark.parametrize("name", NAMED)
def test_columns_are_matched_by_name(name: str):
    columns, joints, expected = NAMED[name]
    assert match(columns, len(columns), joints, {}).columns == expected


def test_columns_are_reordered_and_others_left_out():
    found = match(("t2", "joint_3", "gripper", "joint_1", "joint_2"), 5, ARM, {})
    assert found.columns == (3, 4, 1)
    assert found.notes == ("not a joint of the robot, left out: t2, gripper",)


@pytest.mark.parametrize(
    ("columns", "count", "order", "note"),
    [
        ((), 3, (0, 1, 2), "the columns have no names; they are assigned in the robot's order"),
        ((), 4, (0, 1, 2), "column 3 is left out: beyond the robot's joints it is assumed to be a gripper's"),
        (("actual_q_0", "actual_q_2", "actual_q_1"), 3, (0, 2, 1), "are numbered, not named"),
        (("field.position0", "field.position1", "field.position2", "field.velocity0"), 4, (0, 1, 2), "are numbered"),
    ],
)
def test_columns_without_names_are_matched_by_order(columns, count, order, note):
    found = match(columns, count, ("base", "shoulder", "elbow"), {})
    assert found.columns == order
    assert any(note in said for said in found.notes)


def test_a_mapping_overrides_names():
    columns = "a", "b", "c", "left_joint_1", "left_joint_2", "left_joint_3", "right_joint_1"
    assert match(columns, 7, ARM, {"a": "joint_3", "b": "joint_1", "c": "joint_2"}).columns == (1, 2, 0)
    assert match(columns, 7, ARM, {"left_*": "*"}).columns == (3, 4, 5)
    for pairs in ([("left_*", "*"), ("a", "joint_2")], [("a", "joint_2"), ("left_*", "*")]):
        assert match(columns, 7, ARM, dict(pairs)).columns == (3, 0, 5)
    assert match((), 3, ARM, {"2": "joint_1", "1": "joint_2", "0": "joint_3"}).columns == (2, 1, 0)


@pytest.mark.parametrize(
    ("columns", "mapping", "sentence"),
    [
        (("a", "b", "c"), {}, "no column for joint_1, joint_2, joint_3; its columns are a, b, c"),
        (("joint_1", "joint_2"), {}, "no column for joint_3"),
        (("base", "joint_2", "joint_3"), {}, "no column for joint_1; its other columns are base, the robot has"),
        (("joint_1", "joint_2", "joint_3", "joint_4"), {}, "another robot's: joint_4 is not among the robot's"),
        (
            ("joint_1", "joint_2"),
            {},
            "no column for joint_3: it has 2 columns, joint_1, joint_2, and the robot has 3 joints",
        ),
        (("x_joint_1", "y_joint_1", "joint_2", "joint_3"), {}, "2 columns can be joint_1: x_joint_1 and y_joint_1"),
        (("joint_1", "joint_1", "joint_2", "joint_3"), {}, "2 columns are named joint_1; rename or delete one"),
        (("a", "b", "c"), {"d": "joint_1"}, "--map d=joint_1: there is no column 'd'; there are a, b, c"),
        (("a", "b", "c"), {"a": "elbow"}, "--map a=elbow: the robot has no joint 'elbow' for a; it has joint_1"),
        (("vel_1", "vel_2", "vel_3"), {}, "no column for joint_1"),
        (
            ("x", "y", "z", "qw", "qx", "qy", "qz"),
            {},
            "has poses of the tool (x, y, z, qw, qx, qy, qz)",
        ),
        ((), {}, "no column for joint_1, joint_2, joint_3; its columns are 0, 1, 2, 3, 4, 5"),
    ],
)
def test_ambiguous_and_missing_columns_are_refused(columns, mapping, sentence):
    with pytest.raises(Mismatch) as caught:
        match(columns, len(columns) or 6, ARM, mapping)
    assert sentence in str(caught.value)


def test_fewer_columns_than_joints_cannot_be_mapped():
    with pytest.raises(
        Mismatch, match=r"no column for joint_1, joint_2, joint_3: it has 2 columns, 0, 1, and the robot"
    ):
        match((), 2, ARM, {})


def test_a_family_that_counts_from_zero_is_named_one_by_one():
    columns = "actual_q_0", "actual_q_1", "actual_q_2", "x"
    with pytest.raises(
        Mismatch, match=r"no column for joint_3, for its columns count from 0 .* --map actual_q_0=joint_1 …"
    ):
        match(columns, 4, ARM, {"actual_q_*": "joint_*"})
    assert match(columns, 4, ARM, {f"actual_q_{k}": f"joint_{k + 1}" for k in range(3)}).columns == (0, 1, 2)


def test_the_mapping_of_a_numbered_family_is_proposed():
    with pytest.raises(Mismatch, match=r"--map 'A\*=joint_\*' …"):
        match(("A1", "A2"), 2, ("joint_1", "joint_2"), {})
    assert match(("A1", "A2"), 2, ("joint_1", "joint_2"), {"A*": "joint_*"}).columns == (0, 1)


@pytest.mark.parametrize(
    ("mapping", "said"),
    [
        ({"a": "joint_1", "b": "joint_1"}, "a and b would both be joint_1; map one column to each joint"),
        ({"*": "joint_1"}, "a and b would both be joint_1"),
        ({"a": "joint_1", "a*": "joint_2"}, "--map a=joint_1: a is mapped to joint_2, too"),
    ],
)
def test_a_contradictory_mapping_is_refused(mapping: dict[str, str], said: str):
    with pytest.raises(Mismatch) as refused:
        match(("a", "b", "c"), 3, ARM, mapping)
    assert said in str(refused.value)
