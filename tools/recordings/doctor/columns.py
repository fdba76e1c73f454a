"""Faults of columns: which are joints of the arm, and in which order."""

import re
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from tools.recordings.doctor.finding import Finding, Robot
from tools.recordings.doctor.signals import counted
from tools.recordings.recording import Recording

GRIPPER = re.compile(r"grip|finger|jaw|claw|knuckle", re.IGNORECASE)

FEW_VALUES = 4
"""A column of so few different values is a switch, no joint."""


def gripper(recording: Recording, robot: Robot | None) -> Iterator[Finding]:
    """Columns of a gripper: by name, or beyond the arm's joints where no column has a name."""
    joints = robot.joint_names if robot else ()
    for column in recording.columns:
        if column not in joints and GRIPPER.search(column):
            yield Finding(f"{column} is a gripper's column and is left out", True, column=column)
    extra = recording.values.shape[1] - len(joints)
    if recording.columns or not joints or extra not in (1, 2):
        return
    for number in range(len(joints), len(joints) + extra):
        sentence = (
            f"column {number + 1} is left out: the arm has {counted(len(joints), 'joint')}, and a column beyond "
            "them is taken for a gripper's"
        )
        yield Finding(sentence, True, column=column_name(recording, number))


def switch(recording: Recording, robot: Robot | None) -> Iterator[Finding]:
    """Columns that jump between a few values: a gripper's or a flag under another name."""
    joints = robot.joint_names if robot else ()
    for column, values in zip(recording.columns, recording.values.T, strict=True) if recording.columns else ():
        levels = len(np.unique(values[np.isfinite(values)]))
        if column not in joints and 2 <= levels <= FEW_VALUES < len(values) / 10:
            sentence = f"{column} has {levels} different values, so it is a switch, no joint, and is left out"
            yield Finding(sentence, True, column=column)


def alien(recording: Recording, robot: Robot | None) -> Iterator[Finding]:
    """Columns beside those of the arm's joints."""
    joints = robot.joint_names if robot else ()
    if joints and set(joints) <= set(recording.columns):
        for column in recording.columns:
            if column not in joints:
                yield Finding(f"{column} is no joint of the arm and is left out", True, column=column)


def order(recording: Recording, robot: Robot | None) -> Iterator[Finding]:
    """Columns that are not the arm's joints in the arm's order."""
    if robot is None:
        return
    joints, columns = robot.joint_names, recording.columns
    count = recording.values.shape[1]
    if not set(joints) & set(columns):
        if count != len(joints):
            named = f" ({', '.join(columns)})" if columns else ""
            sentence = (
                f"the recording has {counted(count, 'column')} of positions{named} and the arm "
                f"{counted(len(joints), 'joint')}; say which is which with --map THEIRS=OURS"
            )
            yield Finding(sentence, fatal=True)
        return
    if missing := [joint for joint in joints if joint not in columns]:
        sentence = (
            f"no column is named {missing[0]}, a joint of the arm; the recording has {', '.join(columns)}; "
            f"say which it is with --map THEIRS={missing[0]}"
        )
        yield Finding(sentence, fatal=True)
        return
    if columns != tuple(joints):
        yield Finding("the columns are in another order than the arm's joints; they are put in the arm's", True)


def drop_columns(recording: Recording, findings: list[Finding], robot: Robot | None) -> Recording:
    """The recording without the columns of the findings."""
    left_out = {finding.column for finding in findings}
    count = recording.values.shape[1]
    keep = [number for number in range(count) if column_name(recording, number) not in left_out]
    return _columns(recording, keep)


def put_in_order(recording: Recording, findings: list[Finding], robot: Robot | None) -> Recording:
    """The recording with the arm's joints as its columns; without a name in common, they are taken as they are."""
    if robot is None or not set(robot.joint_names) <= set(recording.columns):
        names = tuple(column_name(recording, number) for number in range(recording.values.shape[1]))
        return replace(recording, columns=robot.joint_names if robot else names)
    return _columns(recording, [recording.columns.index(joint) for joint in robot.joint_names])


def column_name(recording: Recording, number: int) -> str:
    """The column's name, or its number."""
    return recording.columns[number] if recording.columns else f"column {number + 1}"


def _columns(recording: Recording, keep: list[int]) -> Recording:
    columns = tuple(recording.columns[number] for number in keep) if recording.columns else ()
    return replace(recording, columns=columns, values=recording.values[:, keep])
