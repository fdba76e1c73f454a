"""Workloads of the planner: corrections, infeasible goals, alternatives, larger problems."""

from collections import Counter
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from benchmarks.cases import Case, draw, forehand, joint_of
from benchmarks.timing import milliseconds, seconds_of
from motion.alternatives import AllRefused, End, plan_best
from motion.errors import MotionError
from motion.limits import Limits
from motion.plan import Plan, plan
from motion.primitive import Primitive
from motion.request import Boundary, MotionRequest, Waypoint
from robot.description import load_robot

PHASES = 0.3, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95
MOVED, RETIMED = 0.03, 0.03
"""Largest shift of the goal by a correction, rad, and largest change of the time left, as a part of it."""

ALTERNATIVES = 256
SHARES = 0.02, 0.1, 0.2, 0.4
"""Durations of infeasible goals, as parts of a feasible one."""

Summary = dict[str, float]


def _attempt(outcomes: Counter[str], work: Callable[[], object]) -> Callable[[], object]:
    """Return the work with its outcome counted."""

    def attempt() -> None:
        try:
            work()
            outcomes["planned"] += 1
        except (MotionError, AllRefused) as refusal:
            outcomes[type(refusal).__name__] += 1

    return attempt


def _summary(works: list[Callable[[], object]]) -> dict[str, object]:
    outcomes: Counter[str] = Counter()
    seconds = seconds_of([_attempt(outcomes, work) for work in works])
    return {**milliseconds(seconds), "outcomes": dict(outcomes)}


def six_joints(primitive: Primitive, cases: list[Case]) -> dict[str, Summary]:
    """Return the times of plans of all joints, cold and warm in turn."""
    warm = [plan(primitive, case.before).warm for case in cases]
    works: list[Callable[[], object]] = []
    for case, rows in zip(cases, warm, strict=True):
        works.append(lambda case=case: plan(primitive, case.request))
        works.append(lambda case=case, rows=rows: plan(primitive, case.request, warm=rows))
    seconds = seconds_of(works)
    return {"cold": milliseconds(seconds[::2]), "warm": milliseconds(seconds[1::2])}


def revisions(primitive: Primitive, count: int, seed: int) -> dict[str, dict[str, object]]:
    """Return the times of corrections at each phase of the demonstrated motion, including refused ones."""
    rng, limits = np.random.default_rng(seed), load_robot().limits
    joints, free = primitive.joint_count, np.full(primitive.joint_count, np.nan)
    rest = np.zeros(joints)
    goal = Boundary(primitive.goal.positions, primitive.goal.velocities, free)
    start = Boundary(primitive.start.positions, rest, rest)
    swing = plan(primitive, MotionRequest(start, goal, primitive.duration, limits))
    found = {}
    for phase in PHASES:
        reached = swing.sample(np.array([phase * swing.duration]))
        begin = Boundary(reached.positions[0], reached.velocities[0], reached.accelerations[0])
        works: list[Callable[[], object]] = []
        for _ in range(count):
            moved = replace(goal, positions=goal.positions + rng.uniform(-MOVED, MOVED, joints))
            left = (1 - phase) * swing.duration * (1 + rng.uniform(-RETIMED, RETIMED))
            request = MotionRequest(begin, moved, left, limits, phase=phase)
            works.append(lambda request=request: plan(primitive, request, warm=swing.warm, remedy=False))
        found[f"phase {phase}"] = _summary(works)
    return found


def refusals(primitive: Primitive, cases: list[Case]) -> dict[str, dict[str, object]]:
    """Return the times of infeasible goals.

    They have too little time, with and without a search for a feasible duration; limits for which no duration is
    feasible; or a velocity from which the arm cannot stop.
    """
    shortened = [replace(case.request, duration=case.request.duration * share) for case in cases for share in SHARES]
    slow = [replace(case.request, limits=_scaled(case.request.limits, 0.05)) for case in cases]
    fast = [replace(case.request, goal=_faster(case.request.goal)) for case in cases]
    kinds = {
        "too little time": (shortened, True),
        "too little time, arrival_time": (shortened, False),
        "a twentieth of jerk and acceleration": (slow, True),
        "ten times the final velocity": (fast, True),
    }
    return {
        name: _summary(
            [lambda request=request, remedy=remedy: plan(primitive, request, remedy=remedy) for request in requests]
        )
        for name, (requests, remedy) in kinds.items()
    }


def _scaled(limits: Limits, factor: float) -> Limits:
    return Limits(limits.positions, limits.velocities, factor * limits.accelerations, factor * limits.jerks)


def _faster(goal: Boundary) -> Boundary:
    return replace(goal, velocities=10 * goal.velocities)


def alternatives(primitive: Primitive, cases: list[Case], seed: int) -> dict[str, object]:
    """Return the times of ranking 256 ends around the goal and planning the best of them."""
    rng, joints = np.random.default_rng(seed), primitive.joint_count
    works: list[Callable[[], object]] = []
    for case in cases:
        goal, duration = case.request.goal, case.request.duration
        moved = goal.positions + rng.uniform(-0.2, 0.2, (ALTERNATIVES, joints))
        ends = [
            End(replace(goal, positions=positions), duration * (1 + late))
            for positions, late in zip(moved, rng.uniform(-0.1, 0.1, ALTERNATIVES), strict=True)
        ]
        own = End(goal, duration)
        works.append(lambda case=case, ends=[own, *ends]: plan_best(primitive, case.request, ends))
    return _summary(works)


def growth(count: int) -> dict[str, dict[str, object]]:
    """Return the times of a cold plan by basis functions, joints and waypoints."""
    found = {}
    for size in (20, 50, 100, 200, 400):
        primitive = joint_of(forehand(size), 1)
        found[f"one joint, {size} functions"] = _cold(primitive, [case.request for case in draw(primitive, count, 7)])
    for joints in (1, 2, 4, 6, 12):
        primitive = forehand(joints=joints)
        found[f"{joints} joints"] = _cold(primitive, [case.request for case in draw(primitive, count, 7)])
    primitive = forehand()
    for waypoints in (0, 1, 2, 4):
        requests = [with_waypoints(primitive, case.request, waypoints) for case in draw(primitive, count, 7)]
        found[f"6 joints, {waypoints} waypoints"] = _cold(primitive, requests)
    return found


def with_waypoints(primitive: Primitive, request: MotionRequest, count: int) -> MotionRequest:
    """Return the request with waypoints on its own plan, so that it stays feasible."""
    times = request.duration * np.linspace(0, 1, count + 2)[1:-1]
    through = plan(primitive, request).sample(times).positions
    free = np.full(request.joint_count, np.nan)
    return replace(request, waypoints=tuple(Waypoint(float(t), p, free) for t, p in zip(times, through, strict=True)))


def _cold(primitive: Primitive, requests: list[MotionRequest]) -> dict[str, object]:
    def work(request: MotionRequest) -> Callable[[], Plan]:
        return lambda: plan(primitive, request)

    return _summary([work(request) for request in requests])
