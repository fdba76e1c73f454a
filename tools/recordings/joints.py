"""Match the columns of a recording to the joints of a robot."""

import operator
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from typing import Any

from motion.listing import listed
from tools.recordings import names


class Mismatch(Exception):
    """The columns cannot be matched to the robot's joints; the message does not name the file."""


DIGITS = "0123456789"

OTHER_ROBOT = "name the other robot (--robot NAME; inspect: --robot-config FILE)"

NAMED = 8
"""Largest number of columns or joints that a sentence names."""

GRIPPER_COLUMNS = 2
"""Largest number of columns of a gripper, one or one for each finger, which follow those of the arm."""


@dataclass(frozen=True, slots=True)
class Matching:
    """The column of each joint, in the robot's order, and sentences about assumptions and omitted columns."""

    columns: tuple[int, ...]
    notes: tuple[str, ...] = ()


def match(columns: Sequence[str], count: int, joints: Sequence[str], mapping: Mapping[str, str]) -> Matching:
    """Match the columns of a recording to the joints of a robot.

    Names are compared exactly, then without units, case and separators, then by their ends (`panda_joint1` and
    `joint1`). Columns without names, or with numbers as names, are assigned in order if there are as many as joints.

    Args:
        columns: Names of the columns; () for a file without names.
        count: Number of columns.
        joints: Names of the robot's joints, in its order.
        mapping: For names of columns, the names of their joints; both may contain one `*`, which stands for the same
            text. Columns without names are called 0, 1, ….

    Raises:
        Mismatch: a joint has no column or several, or the columns belong to another robot.
    """
    known = list(columns) if columns else [str(index) for index in range(count)]
    mapped = _mapped(known, joints, mapping)
    missing = [joint for joint in joints if joint not in mapped]
    found = {**mapped, **(_by_name(known, missing, mapped) if columns else {})}
    if len(found) == len(joints):
        _refuse_another_robot(known, found, bool(mapping))
        return Matching(tuple(found[joint] for joint in joints), _left_out(known, found.values()))
    ordered = _in_order(known, columns, joints) if not found else None
    if ordered is None:
        raise Mismatch(_missing(known, joints, found))
    return ordered


def _mapped(columns: Sequence[str], joints: Sequence[str], mapping: Mapping[str, str]) -> dict[str, int]:
    found: dict[str, int] = {}
    patterns: dict[str, str] = {}
    for theirs, ours in sorted(mapping.items(), key=lambda pair: "*" not in pair[0]):  # names go before patterns
        fitting = [index for index, column in enumerate(columns) if fnmatchcase(column, _literal(theirs))]
        if not fitting:
            raise Mismatch(f"--map {theirs}={ours}: there is no column {theirs!r}; there are {listed(columns, NAMED)}")
        named = False
        for index in fitting:
            joint = _renamed(columns[index], theirs, ours)
            if joint not in joints:
                continue
            if joint in found and ("*" in theirs or "*" not in patterns[joint]):
                both = f"{columns[found[joint]]} and {columns[index]}"
                raise Mismatch(f"--map {theirs}={ours}: {both} would both be {joint}; map one column to each joint")
            if other := next((other for other, taken in found.items() if taken == index and other != joint), None):
                raise Mismatch(
                    f"--map {theirs}={ours}: {columns[index]} is mapped to {other}, too; give one of the two"
                )
            found[joint], patterns[joint], named = index, theirs, True
        if not named:
            first = columns[fitting[0]]
            raise Mismatch(
                f"--map {theirs}={ours}: the robot has no joint {_renamed(first, theirs, ours)!r} for {first}; it has "
                f"{listed(joints, NAMED)}"
            )
    return found


def _literal(pattern: str) -> str:
    """Escape a pattern, so that only `*` is special."""
    return "".join(f"[{character}]" if character in "[?" else character for character in pattern)


def _renamed(column: str, theirs: str, ours: str) -> str:
    before, star, after = theirs.partition("*")
    return ours.replace("*", column[len(before) : len(column) - len(after)]) if star else ours


def _by_name(columns: Sequence[str], joints: Sequence[str], mapped: Mapping[str, int]) -> dict[str, int]:
    """Return the joints with a column, by the first comparison that finds all joints, or by the one that finds most."""
    free = [index for index in range(len(columns)) if index not in mapped.values()]
    named = [index for index in free if not names.is_other(columns[index])]
    plain, words = {index: columns[index] for index in free}, _words([columns[index] for index in named], joints)
    spelled = dict(zip(named, words, strict=True))
    best: dict[str, int] = {}
    for keys, like in ((plain, operator.eq), (spelled, _alike), (spelled, _ends)):
        found = _found(keys, like, joints, columns)
        if len(set(found.values())) == len(found) > len(best):
            best = found
        if len(best) == len(joints):
            break
    return best


def _found(
    keys: Mapping[int, object], like: Callable[[Any, Any], bool], joints: Sequence[str], columns: Sequence[str]
) -> dict[str, int]:
    """Return the joints with a column. Raises Mismatch if several columns can be the same joint."""
    found: dict[str, int] = {}
    for joint in joints:
        wanted = joint if like is operator.eq else names.joint_words(joint)
        alike = [index for index, key in keys.items() if like(key, wanted)]
        if len(alike) > 1:
            choices = " and ".join(columns[index] for index in alike)
            if len({columns[index] for index in alike}) == 1:
                raise Mismatch(f"{len(alike)} columns are named {columns[alike[0]]}; rename or delete one")
            raise Mismatch(
                f"{len(alike)} columns can be {joint}: {choices}; choose with --map, as "
                f"--map {_star(columns[alike[0]], joint)}"
            )
        if alike:
            found[joint] = alike[0]
    return found


def _words(columns: Sequence[str], joints: Sequence[str]) -> list[tuple[str, ...]]:
    """Return the words of the columns; if only the columns are numbered from 0, their numbers are increased by 1."""
    spelled = [names.joint_words(column) for column in columns]
    from_zero = {parts[:-1] for parts in spelled if parts[-1:] == ("0",)}
    if any("0" in names.joint_words(joint) for joint in joints):
        return spelled
    return [
        (*parts[:-1], str(int(parts[-1]) + 1)) if parts[:-1] in from_zero and parts[-1].isdecimal() else parts
        for parts in spelled
    ]


def _alike(a: tuple[str, ...], b: tuple[str, ...]) -> bool:
    return a == b != ()


def _ends(a: tuple[str, ...], b: tuple[str, ...]) -> bool:
    """Return whether the shorter of two names is the end or the beginning of the other."""
    short, long = sorted((a, b), key=len)
    return bool(short) and (long[-len(short) :] == short or long[: len(short)] == short)


def _star(column: str, joint: str) -> str:
    """Return a mapping, for a whole family (left_*=*) if the column's name ends with that of the joint."""
    return f"'{column.removesuffix(joint)}*=*'" if column.endswith(joint) else f"{column}={joint}"


def _refuse_another_robot(columns: Sequence[str], found: Mapping[str, int], chosen: bool) -> None:
    """Raise Mismatch if more columns belong to the same family of joints, as for an arm with more joints."""
    families = {_family(columns[index]) for index in found.values()}
    more = [
        column
        for index, column in enumerate(columns)
        if index not in found.values() and not names.is_other(column) and not names.is_gripper(column)
        and _family(column) in families and _family(column)
    ]  # fmt: skip
    if more and not chosen:
        raise Mismatch(
            f"its joints are another robot's: {listed(more, NAMED)} is not among the robot's joints, "
            f"{listed([*found], NAMED)}; "
            f"{OTHER_ROBOT}, or choose columns with --map THEIRS=OURS"
        )


def _family(name: str) -> tuple[str, ...]:
    """Return the words of a numbered joint without the number, or () for other names."""
    parts = names.joint_words(name)
    return parts[:-1] if len(parts) > 1 and parts[-1].isdecimal() else ()


def _in_order(known: Sequence[str], columns: Sequence[str], joints: Sequence[str]) -> Matching | None:
    """Match unnamed or numbered columns by their order; up to two further columns may belong to a gripper."""
    if columns:
        measured = [i for i in range(len(known)) if not names.is_other(known[i]) and not names.is_gripper(known[i])]
        numbers = {index: number for index in measured if (number := _number(known[index])) is not None}
        fitting = sorted(numbers, key=numbers.__getitem__)
        why = f"{listed([known[index] for index in fitting], NAMED)} are numbered, not named"
    else:
        fitting = list(range(len(known)))
        why = "the columns have no names"
    beyond = [known[index] for index in fitting[len(joints) :]]
    if len(fitting) < len(joints) or len(beyond) > (0 if columns else GRIPPER_COLUMNS):
        return None
    taken = fitting[: len(joints)]
    notes = [f"{why}; they are assigned in the robot's order, {listed(joints, NAMED)}"]
    notes += [
        f"column {column} is left out: beyond the robot's joints it is assumed to be a gripper's" for column in beyond
    ]
    return Matching(tuple(taken), (*notes, *(_left_out(known, taken) if columns else ())))


def _number(name: str) -> int | None:
    """Return the number of a name that has only words for a joint and a number: 3 for `q3`, `position[3]`, `3`."""
    parts = [part for part in names.joint_words(name) if part != "joint"]
    return int(parts[0]) if len(parts) == 1 and parts[0].isdecimal() else None


def _left_out(columns: Sequence[str], taken: Iterable[int]) -> tuple[str, ...]:
    chosen = set(taken)
    rest = [column or "a column without a name" for index, column in enumerate(columns) if index not in chosen]
    return (f"not a joint of the robot, left out: {listed(rest, NAMED)}",) if rest else ()


def _missing(columns: Sequence[str], joints: Sequence[str], found: Mapping[str, int]) -> str:
    missing = [joint for joint in joints if joint not in found]
    free = [column for index, column in enumerate(columns) if index not in found.values()]
    if not found and names.are_poses(columns):
        return f"it {names.ONLY_POSES.format(listed(columns, NAMED))}"
    if len(columns) < len(joints):
        return (
            f"it has no column for {listed(missing, NAMED)}: it has {len(columns)} columns, {listed(columns, NAMED)}, "
            f"and the robot has {len(joints)} joints; record all of them, or {OTHER_ROBOT}"
        )
    if _counts_from_zero(free[0], [columns[index] for index in found.values()]) and joints[0].endswith("1"):
        return (
            f"it has no column for {listed(missing, NAMED)}, for its columns count from 0 and the joints from 1; name "
            f"each, --map {free[0]}={joints[0]} …"
        )
    return (
        f"it has no column for {listed(missing, NAMED)}; its {'other ' if found else ''}columns are "
        f"{listed(free, NAMED)}, the robot has {len(joints)} joints; name them with "
        f"--map {_family_map(free, missing)} …"
    )


def _counts_from_zero(free: str, taken: Sequence[str]) -> bool:
    """Return whether a column that is no joint's has the number 0 in a family of which other columns are joints'."""
    stem = free.rstrip(DIGITS)
    return free == f"{stem}0" and any(column.rstrip(DIGITS) == stem for column in taken)


def _family_map(columns: Sequence[str], joints: Sequence[str]) -> str:
    """Return a mapping such as 'A*=joint_*' if the numbers of columns and joints agree, else of the first ones."""
    theirs, ours = columns[0].rstrip(DIGITS), joints[0].rstrip(DIGITS)
    numbers = [joint.removeprefix(ours) for joint in joints]
    if theirs and all(number and f"{theirs}{number}" in columns for number in numbers):
        return f"'{theirs}*={ours}*'"
    return f"{columns[0]}={joints[0]}"
