"""Find postures with the tool at a pose, or the reason that there is none."""

from collections.abc import Iterable, Sequence

import numpy as np

from robot.description import RobotConfig
from robot.tool_descent import MET, ToolDescent
from robot.tool_target import Posture, ToolTarget, Unreachable
from robot.tool_velocities import joint_velocities

RANDOM_SEEDS, FURTHER_SEEDS = 6, 24
"""Number of random seeds, and of further ones if the tool reaches the position but not the orientation."""
SAME_POSTURE = 0.02
"""Difference of two distinct postures on some joint, rad."""


class InverseKinematics:
    """Inverse kinematics of one arm. Not thread-safe: use one a thread."""

    def __init__(self, config: RobotConfig) -> None:
        self._names = config.joint_names
        self._tool = ToolDescent(config)
        count = RANDOM_SEEDS + FURTHER_SEEDS
        self._spread = np.random.default_rng(0).uniform(size=(count, config.joint_count))

    def postures(self, target: ToolTarget, ranges: np.ndarray, seeds: Sequence[np.ndarray]) -> list[np.ndarray]:
        """Return postures (J,) inside `ranges` (J, 2) that meet a target, the nearest to the first seed first.

        The search starts from the seeds (J,) and from random ones, which are the same each time. A redundant arm comes
        as near to the first seed as the target allows.

        Raises:
            Unreachable: no posture was found.
        """
        inside: list[np.ndarray] = []
        for seed in (np.clip(seed, *ranges.T) for seed in seeds):
            if all(np.abs(seed - other).max() > SAME_POSTURE for other in inside):
                inside.append(seed)
        random = self._random(inside[0], ranges)
        first, further = [*inside, *random[:RANDOM_SEEDS]], random[RANDOM_SEEDS:]
        found, nearest = self._search(target, ranges, inside[0], first)
        can_be_there = not found and target.points and self._is_met(target.anywhere, ranges, first)
        if can_be_there:
            found, _ = self._search(target, ranges, inside[0], further)
        if not found:
            raise self._unreachable(target, ranges, first, self._tool.posture(target, nearest), can_be_there)
        return sorted(found, key=lambda positions: self._tool.distance(positions, inside[0]))

    def nearby(self, target: ToolTarget, ranges: np.ndarray, seed: np.ndarray) -> np.ndarray | None:
        """Return the posture (J,) that a descent from the seed reaches, or None if it does not meet the target."""
        seed = np.clip(seed, *ranges.T)
        positions, error = self._tool.descend(target, seed, ranges)
        return self._tool.pull(target, positions, seed, ranges) if error <= MET else None

    def velocities(self, target: ToolTarget, positions: np.ndarray, limits: np.ndarray) -> np.ndarray:
        """Return the joint velocities (J,), within `limits` (J,), of the target's tool velocity.

        They are zero for a target without velocities.

        Raises:
            Unreachable: no such velocities exist.
        """
        if target.velocity is None and target.angular_velocity is None:
            return np.zeros(len(positions))
        found = joint_velocities(*self._tool.motion(target, positions), limits, self._names)
        if isinstance(found, str):
            raise Unreachable("velocity", found, self._tool.posture(target, positions))
        return found

    def _random(self, around: np.ndarray, ranges: np.ndarray) -> np.ndarray:
        """Return random postures inside the ranges and within half a turn of a given one."""
        low, high = np.maximum(ranges[:, 0], around - np.pi), np.minimum(ranges[:, 1], around + np.pi)
        return low + self._spread * (high - low)

    def _search(
        self, target: ToolTarget, ranges: np.ndarray, preferred: np.ndarray, seeds: Iterable[np.ndarray]
    ) -> tuple[list[np.ndarray], np.ndarray]:
        """Return the distinct postures that the seeds lead to, and the one that comes nearest to the target."""
        found: list[np.ndarray] = []
        nearest, least = preferred, np.inf
        for seed in seeds:
            positions, error = self._tool.descend(target, seed, ranges)
            if error < least:
                nearest, least = positions, error
            if error > MET:
                continue
            pulled = self._tool.wind(self._tool.pull(target, positions, preferred, ranges), preferred, ranges)
            if all(np.abs(pulled - other).max() > SAME_POSTURE for other in found):
                found.append(pulled)
        return found, nearest

    def _is_met(self, target: ToolTarget, ranges: np.ndarray, seeds: Iterable[np.ndarray]) -> bool:
        return any(self._tool.descend(target, seed, ranges)[1] <= MET for seed in seeds)

    def _unreachable(
        self,
        target: ToolTarget,
        ranges: np.ndarray,
        seeds: Sequence[np.ndarray],
        nearest: Posture,
        can_be_there: bool,
    ) -> Unreachable:
        """Return why no posture meets a target, by searching again without the ranges of hinges."""
        wide = np.where(self._tool.turns[:, None], [-np.inf, np.inf], ranges)
        if can_be_there and not self._is_met(target, wide, seeds):
            reason, why = "orientation", "the arm can be there, but no posture was found in which the tool points so"
        elif can_be_there or self._is_met(target.anywhere, wide, seeds):
            reason, why = "joint ranges", "every posture that brings it there is outside the joint ranges"
        else:
            reason, why = "out of reach", "the arm does not reach there"
        away = f"{nearest.distance:.3g} m" + (f" and {nearest.angle:.3g} rad" if target.points else "")
        sentence = (
            f"the tool cannot be at {_rounded(target.position)}: {why}; "
            f"the nearest pose found is {away} away, at {_rounded(nearest.position)}"
        )
        return Unreachable(reason, sentence, nearest)


def _rounded(position: np.ndarray) -> str:
    return "[" + ", ".join(f"{value:.3f}" for value in position) + "] m"
