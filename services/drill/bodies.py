"""Messages that are right, for a drill to make them wrong."""

from typing import Any

import msgspec
import numpy as np

from protocol import messages as m
from protocol import topics
from protocol.codec import matrix_bytes
from services.drill.cell import Cell

Body = dict[str, Any]


def good_requests(cell: Cell) -> list[tuple[str, Body]]:
    """Return, with their keys, requests that are taken in this order, each at the start of a run.

    Between them they have every field, though not every combination. `execute` comes first, since any other plan
    makes it obsolete.
    """
    home, joints = cell.home, len(cell.home)
    played = cell.strike()
    cell.finish(played)
    cell.reset()
    near, free, still = [home[0] + 0.3, *home[1:]], [None] * (joints - 1), [0.0] * joints
    swing = {"primitive": "forehand", "positions": near, "velocities": [0.5, *still[1:]]}
    samples = np.linspace(home, near, 50)
    demonstration = {"name": "nod", "replace": True}
    return [
        ("execute", plan_for_now(cell)),
        ("goal", {"primitive": "forehand", "positions": home, "duration": 1.0}),
        (
            "goal",
            {
                **swing,
                "accelerations": [0.0, *free],
                "duration": 1.5,
                "waypoints": [
                    {"time_from_start": 0.7, "positions": [home[0] + 0.1, *free]},
                    {"time_from_start": 1.1, "velocities": [*free, 0.1]},
                ],
                "limits": {
                    "positions": [[home[0] - 0.5, home[0] + 1.0], *free],
                    "velocities": [8.0, *free],
                    "accelerations": [*free, 200.0],
                    "jerks": [*free, 9000.0],
                },
                "client_id": "drill",
                "include_trajectory": True,
            },
        ),
        (
            "goal",
            {
                **swing,
                "arrival_time": 1.5,
                "start": {"positions": home, "velocities": still, "accelerations": [0.0, *free]},
                "rest_fraction": 0.1,
                "tail": "coast",
                "plan_only": True,
            },
        ),
        ("goal", {**swing, "duration": 1.5, "method": "dmp", "plan_only": True}),
        ("primitives", {}),
        ("learn", {**demonstration, "positions": samples.tolist(), "rate": 100.0}),
        (
            "learn",
            {
                **demonstration,
                "positions": matrix_bytes(samples),
                "joint_count": joints,
                "times": np.linspace(0.0, 0.5, 50).tolist(),
                "smoothing": {"window_s": 0.11, "order": 3},
            },
        ),
        ("forget", {"name": "nod"}),
        ("reference", {"lead": 0.1}),
        ("cancel", {"goal_id": played.goal_id}),
        ("reset", {}),
        ("result", {"goal_id": played.goal_id}),
        ("status", {}),
        ("state", {}),
        ("description", {}),
        ("sim/step", {"ticks": 1}),
        ("sim/reset", {"positions": home, "seed": 1, "ball": {"position": [2.0, 0.0, 1.0], "velocity": [0.0] * 3}}),
        ("sim/disturb", {"kind": "acceleration", "values": [1.0, *still[1:]], "start_time": 0.1, "duration": 0.1}),
        ("sim/disturb", {"kind": "torque", "values": [1.0, *still[1:]], "duration": 0.1}),
        ("sim/disturb", {"kind": "sensor_noise", "position_std": 1e-4, "velocity_std": 1e-3}),
        ("sim/disturb", {"kind": "loss", "stream": "state", "duration": 0.01}),
    ]


def plan_for_now(cell: Cell) -> Body:
    """Return a trajectory that `execute` takes until another plan is accepted or the present run is over."""
    trajectory = cell.strike(plan_only=True, include_trajectory=True).trajectory
    return msgspec.to_builtins(trajectory, builtin_types=(bytes,))


def good_publications(cell: Cell) -> dict[topics.Publication, Body]:
    """Return a message of every topic."""
    reply = cell.strike()
    plan, vector = cell.plan_of(reply), [0.1, 0.2, 0.3]
    cell.finish(reply)
    late: dict[str, Any] = {"code": "late", "message": "too late", "detail": {"goal_id": "late"}}
    pushed = m.ActiveDisturbance(kind="acceleration", values=[0.1] * len(cell.home), end_time=0.2)
    said = {
        topics.STATE: cell.state(),
        topics.COMMAND: cell.commands()[-1],
        topics.PLAN: plan,
        topics.REFUSED: m.Refused(goal_id="late", client_id="", primitive="forehand", requested=1, **late),
        topics.STATUS: cell.status(),
        topics.ENDED: cell.result(reply.goal_id),
        topics.CONTACT: m.Contact(time=0.1, bodies=["racket", "ball"], impulse=0.1, ball_velocity=vector),
        topics.BALL: m.BallState(time=0.1, position=vector, velocity=vector),
        topics.DISTURBANCE: m.Disturbance(time=0.1, active=[pushed]),
    }
    cell.reset()
    return {topic: msgspec.to_builtins(message, builtin_types=(bytes,)) for topic, message in said.items()}
