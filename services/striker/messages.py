"""The striker's messages: goals for the planner, and publications about each ball."""

from typing import Literal

import numpy as np

from protocol import messages as m
from robot.description import RobotConfig
from robot.striking.choice import Choice
from robot.striking.path import Path
from services.striker.attempt import Attempt, PendingGoal
from services.striker.outcomes import Outcome

READY = "ready"
"""Name of the primitive that returns the arm to its ready pose, if the library has it."""
READY_S = 0.7
"""Duration of the return, s."""
PATH_POINTS = 24
CLIENT = "striker"
Method = Literal["qp", "dmp"]


def goal_message(pending: PendingGoal, primitive: str, follow_through: float, method: Method) -> m.Goal:
    """Return the goal of a hit, or of its correction; `follow_through` (s) is for the method qp."""
    return m.Goal(
        primitive=primitive,
        positions=pending.choice.positions.tolist(),
        velocities=pending.choice.velocities.tolist(),
        arrival_time=pending.choice.goal_time,
        follow_through=follow_through if method == "qp" else 0.0,
        method=method,
        revises=pending.revises,
        goal_id=pending.goal_id,
        client_id=CLIENT,
    )


def ready_goal(goal_id: str, config: RobotConfig, primitive: str) -> m.Goal:
    """Return the goal that returns the arm to the ready pose."""
    home = config.home.tolist()
    return m.Goal(primitive=primitive, positions=home, duration=READY_S, goal_id=goal_id, client_id=CLIENT)


def strike_message(
    attempt: Attempt, phase: m.StrikePhase, now: float, path: Path | None, reason: str, outcome: Outcome | None
) -> m.Strike:
    """Return the publication about a ball. path: its prediction; outcome: how it left the hit."""
    choice = attempt.pending.choice if attempt.pending else attempt.choice
    return m.Strike(
        ball=attempt.ball,
        phase=phase,
        time=now,
        sight=attempt.sight_time if np.isfinite(attempt.sight_time) else None,
        prediction=None if path is None else _prediction(path, choice.time if choice else float(path.times[-1])),
        racket=None if choice is None else _aim(choice),
        goal_id=attempt.goal_id,
        revisions=attempt.revisions,
        hit=None if outcome is None else _hit(outcome),
        landing=None if outcome is None or choice is None else _landing(outcome, choice.target),
        reason=reason,
    )


def _prediction(path: Path, until: float) -> m.BallPrediction:
    until = float(np.clip(until, path.times[0], path.times[-1]))
    times = np.linspace(path.times[0], until, PATH_POINTS)
    places, speeds = path.at(times)
    spread = np.sqrt(np.diagonal(path.covariance(times[-1:])[0])[:3])
    return m.BallPrediction(
        time=until,
        position=_triple(places[-1]),
        velocity=_triple(speeds[-1]),
        spread=_triple(spread),
        path=[_triple(place) for place in places],
    )


def _aim(choice: Choice) -> m.RacketAim:
    return m.RacketAim(
        time=choice.time,
        position=_triple(choice.racket_position),
        normal=_triple(choice.racket_normal),
        velocity=_triple(choice.racket_velocity),
        outgoing=_triple(choice.outgoing),
        landing=_triple(choice.target),
        error=choice.error,
    )


def _hit(outcome: Outcome) -> m.BallHit:
    velocity = None if outcome.velocity is None else _triple(outcome.velocity)
    return m.BallHit(time=outcome.time, position=_triple(outcome.position), velocity=velocity)


def _landing(outcome: Outcome, target: np.ndarray) -> m.Landing | None:
    if outcome.landing is None:
        return None
    time, place = outcome.landing
    distance = float(np.linalg.norm(place[:2] - target[:2]))
    return m.Landing(time=time, position=_triple(place), distance=distance)


def _triple(vector: np.ndarray) -> tuple[float, float, float]:
    x, y, z = (float(value) for value in vector)
    return x, y, z
