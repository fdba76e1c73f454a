"""Publications for the recorder's tests, of an arm with six joints."""

from collections import deque
from typing import Any, cast

import numpy as np
from msgspec.structs import replace

from protocol import messages as m
from protocol.codec import matrix_bytes
from protocol.topics import (
    BALL,
    COMMAND,
    CONTACT,
    DISTURBANCE,
    ENDED,
    PLAN,
    REFUSED,
    SCENE,
    STATE,
    STATUS,
    STRIKES,
    Publication,
)
from tests.golden.examples import EXAMPLES

RUN = 1_790_000_000_123_456_789
JOINTS = [f"joint_{index}" for index in range(1, 7)]
VALUES = [0.1, 0.2, 1 / 3, -0.4, 5e-324, 0.6]
SAMPLES = np.arange(24.0).reshape(4, 6) / 7


class FakeStream(deque[tuple[bytes, int]]):
    """Bodies waiting to be taken, with their wall times in Unix ns; stands in for a subscription."""

    def take(self) -> tuple[bytes, int] | None:
        """Remove and return the oldest, or None."""
        return self.popleft() if self else None


def state(tick: int, run: int = RUN, seed: int = 0, brake: bool = False, truth: bool = True, **changes: Any) -> m.State:
    """Return a state whose numbers use the whole mantissa."""
    noise = np.random.default_rng((tick, seed))
    return m.State(
        run=run,
        tick=tick,
        time=tick / 1000.0,
        positions=noise.normal(0, 0.5, 6).tolist(),
        velocities=noise.normal(0, 3, 6).tolist(),
        torques=noise.normal(0, 30, 6).tolist(),
        saturated=(noise.random(6) < 0.3).tolist(),
        brake=brake,
        applied_tick=tick - 1,
        truth=m.Point(positions=noise.normal(0, 1, 6).tolist(), velocities=VALUES) if truth else None,
        **changes,
    )


def command(tick: int, run: int = RUN, goal_id: str | None = None) -> m.Command:
    """Return a command whose numbers use the whole mantissa."""
    noise = np.random.default_rng((tick, 77))
    return m.Command(
        run=run,
        tick=tick,
        source="controller",
        accelerations=noise.normal(0, 50, 6).tolist(),
        positions=noise.normal(0, 0.5, 6).tolist(),
        velocities=noise.normal(0, 3, 6).tolist(),
        goal_id=goal_id,
    )


def plan(start_time: float, count: int = 4, goal_id: str = "g1", **changes: object) -> m.Plan:
    """Return a plan of distinct numbers with its hit at the last sample but one."""
    positions = np.random.default_rng(count).normal(0, 0.3, (count, 6))
    fields: dict[str, object] = {
        "goal_id": goal_id,
        "epoch": 3,
        "joint_names": JOINTS,
        "start_time": start_time,
        "dt": 0.001,
        "count": count,
        "hit_index": count - 2,
        "positions": matrix_bytes(positions),
        "velocities": matrix_bytes(10 * positions),
        "accelerations": matrix_bytes(100 * positions),
        "primitive": "forehand",
        "limits": m.PlanLimits(
            positions=[(-1.0, 1.5), *[None] * 5], velocities=[4.0] * 6, accelerations=[None] * 6, jerks=[None] * 6
        ),
        "demonstration": matrix_bytes(positions[: count - 1] / 2),
        **changes,
    }
    return m.Plan(**fields)  # pyright: ignore[reportArgumentType]


def status(time: float, mode: m.Mode = "tracking", fault: str | None = None, refused: int = 0) -> m.Status:
    """Return a status of the controller."""
    point = m.Point(positions=VALUES, velocities=VALUES)
    lateness = m.Lateness(p50=120.5, p99=400.25, max=900.125)
    return m.Status(
        time=time,
        mode=mode,
        epoch=3,
        goal_id="g1",
        time_from_start=0.25,
        reference=point,
        feedback=point,
        error=point,
        cycle=m.Cycle(count=1000, missed=3, on_time_ratio=0.997, late_us=lateness, refused=refused),
        fault=fault,
    )


def result(outcome: m.Outcome = "succeeded", goal_id: str = "g1", reason: str = "") -> m.Result:
    """Return the result of a goal with a hit at 2 ms."""
    hit = m.Hit(time=0.002, position_error=VALUES, velocity_error=VALUES)
    stamps = m.Stamps(requested=RUN, planned=RUN + 1, accepted=RUN + 2, first_command=None)
    return m.Result(goal_id=goal_id, outcome=outcome, reason=reason, hit=hit, peak_tracking_error=0.0625, stamps=stamps)


def refused(goal_id: str | None = "g2") -> m.Refused:
    """Return the refusal of a goal."""
    return m.Refused(
        goal_id=goal_id,
        client_id="shell-1",
        primitive="forehand",
        code="limit",
        message="joint_1 would end at 2.5 rad",
        detail={"joint": "joint_1", "quantity": "positions", "value": 2.5, "bound": 2.0},
        requested=RUN,
    )


def push(time: float, **values: list[float]) -> m.Disturbance:
    """Return the active disturbances, their values by kind; none without values."""
    active = [m.ActiveDisturbance(kind=kind, values=numbers, end_time=9.0) for kind, numbers in values.items()]
    return m.Disturbance(time=time, active=active)


PLANNED, LANDED = (cast(m.Strike, EXAMPLES[name]) for name in ("Strike", "Strike-landed"))

MESSAGES: dict[Publication, m.Message] = {
    STATE: state(3),
    COMMAND: command(3, goal_id="g1"),
    PLAN: plan(0.004),
    REFUSED: refused(),
    STATUS: status(0.003),
    ENDED: result(),
    CONTACT: m.Contact(time=0.002, bodies=["racket", "ball"], impulse=0.42, ball_velocity=[6.0, 0.0, 1.5]),
    SCENE: m.Scene(time=0.003, joints={"finger": [0.02]}),
    STRIKES: replace(PLANNED, phase="landed", time=0.003, hit=LANDED.hit, landing=LANDED.landing),
    BALL: m.BallState(time=0.003, position=[0.4, -0.7, 0.9], velocity=[0.0, 0.0, 0.0]),
    DISTURBANCE: push(0.003, acceleration=[100.0, 0.0, 0.0, 0.0, 0.0, 0.0]),
}
"""One message of every recorded publication."""
