"""Valid messages, which scenarios make invalid."""

from typing import Any

import msgspec
import numpy as np

from protocol import messages as m
from protocol import topics
from protocol.codec import matrix_bytes
from robot.description import RobotConfig
from robot.kinematics import Kinematics
from tools.drill.harness import short_demo
from tools.drill.harness.cell import Cell

Body = dict[str, Any]
LEAD_S = 0.02


def valid_requests(cell: Cell) -> list[tuple[str, Body]]:
    """Return keys and bodies of requests that are accepted in this order, each at the start of a run.

    Together they have every field, though not every combination. `execute` is accepted after `renewed`.
    """
    played = cell.strike()
    cell.finish(played)
    cell.reset()
    trajectory = cell.strike(plan_only=True, include_trajectory=True).trajectory
    return [
        ("execute", msgspec.to_builtins(trajectory, builtin_types=(bytes,))),
        ("execute", _pieces(trajectory, cell.home)),
        *(("goal", goal) for goal in _goals(cell.home)),
        ("goal", _tool_goal(cell.config)),
        ("primitives", {}),
        *(("learn", demonstration) for demonstration in _demonstrations(cell.home)),
        ("forget", {"name": short_demo.NAME}),
        ("reference", {"lead": 0.1}),
        ("cancel", {"goal_id": played.goal_id}),
        ("reset", {}),
        ("result", {"goal_id": played.goal_id}),
        ("status", {}),
        ("state", {}),
        ("description", {}),
        ("recover", {}),
        ("guide", {}),
        ("sim/step", {"ticks": 1}),
        (
            "sim/reset",
            {"positions": cell.home, "seed": 1, "ball": {"position": [2.0, 0.0, 1.0], "velocity": [0.0] * 3}},
        ),
        ("sim/ball", {"position": [4.0, 0.0, 1.0], "velocity": [-6.0, 0.0, 2.0], "spin": [0.0, 10.0, 0.0]}),
        *(("sim/disturb", disturbance) for disturbance in _disturbances(len(cell.home))),
    ]


def _pieces(trajectory: m.Trajectory | None, home: list[float]) -> Body:
    """Return a trajectory in polynomial pieces that holds the arm at home."""
    coefficients = np.zeros((1, len(home), m.COEFFICIENTS))
    coefficients[0, :, 0] = home
    pieces = {"breaks": [0.0, 0.1], "coefficients": matrix_bytes(coefficients)}
    held = {"goal_id": "held", "count": 101, "hit_index": 0, "pieces": pieces}
    frame = ("epoch", "joint_names", "start_time", "dt")
    return {name: getattr(trajectory, name) for name in frame} | held


def renewed(cell: Cell, key: str, body: Body) -> Body:
    """Return a request that is accepted now: a trajectory gets the present epoch and a start 20 ms from now."""
    if key != topics.EXECUTE.key:
        return body
    reference = cell.bus.ask(topics.REFERENCE, m.ReferenceRequest(lead=LEAD_S))
    return {**body, "epoch": reference.epoch, "start_time": reference.time}


def _goals(home: list[float]) -> list[Body]:
    """Return goals: plain, with waypoints and limits, from a given start, by each other method, alternatives, fastest.

    `revises` is null, because no motion can be corrected at the start of a run.
    """
    free, still = [None] * (len(home) - 1), [0.0] * len(home)
    swing = {"primitive": "forehand", "positions": _near(home), "velocities": [0.5, *still[1:]]}
    shaped = {
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
    }
    from_start = {
        "arrival_time": 1.5,
        "start": {"positions": home, "velocities": still, "accelerations": [0.0, *free]},
        "rest_fraction": 0.1,
        "tail": "coast",
        "plan_only": True,
    }
    several = {
        "positions": None,
        "alternatives": [
            {"positions": home, "velocities": still, "duration": 1.2},
            {"accelerations": [0.0, *free], "arrival_time": 1.5},
        ],
        "revises": None,
        "follow_through": 0.02,
        "place_time": 0.5,
    }
    return [
        {"primitive": "forehand", "positions": home, "duration": 1.0},
        {**swing, **shaped},
        {**swing, **from_start},
        *({**swing, "duration": 1.5, "method": method, "plan_only": True} for method in ("dmp", "gaussian")),
        {**swing, **several},
        {**swing, "fastest": True, "follow_through": 0.1},
    ]


def _tool_goal(config: RobotConfig) -> Body:
    """Return a goal at the tool's pose at home, with a waypoint 5 mm from it."""
    place, rotation = Kinematics(config).tool_pose(config.home)
    along = rotation[:, 2].tolist()
    moves = {"velocity": [0.01, 0.0, 0.0], "angular_velocity": [0.0, 0.01, 0.0]}
    waypoint = {"position": (place - 0.005 * rotation[:, 0]).tolist(), "axis": along}
    return {
        "primitive": "forehand",
        "tool": {"position": place.tolist(), "orientation": None, "axis": along, "velocity": moves["velocity"]},
        "waypoints": [{"time_from_start": 0.7, "tool": waypoint | moves}],
        "duration": 1.5,
        "plan_only": True,
    }


def _demonstrations(home: list[float]) -> list[Body]:
    """Return a demonstration as arrays with a rate, and as a smoothed matrix with times."""
    samples = np.linspace(home, _near(home), 50)
    as_matrix = {
        "positions": matrix_bytes(samples),
        "joint_count": len(home),
        "times": np.linspace(0.0, 0.5, 50).tolist(),
        "smoothing": {"window_s": 0.11, "order": 3},
    }
    as_arrays = {"positions": samples.tolist(), "rate": 100.0, "joint_names": None}
    return [{"name": short_demo.NAME, "replace": True, **how} for how in (as_arrays, as_matrix)]


def _disturbances(joints: int) -> list[Body]:
    """Return a disturbance of each kind."""
    push = {"values": [1.0, *[0.0] * (joints - 1)], "duration": 0.1}
    return [
        {"kind": "acceleration", "start_time": 0.1, **push},
        {"kind": "torque", **push},
        {"kind": "sensor_noise", "position_std": 1e-4, "velocity_std": 1e-3},
        {"kind": "wind", "values": [0.0, 2.0, 0.0]},
        {"kind": "ball_noise", "position_std": 5e-3, "latency_s": 0.01, "drop_rate": 0.1},
        {"kind": "loss", "stream": "state", "duration": 0.01},
    ]


def _near(home: list[float]) -> list[float]:
    return [home[0] + 0.3, *home[1:]]


def valid_publications(cell: Cell) -> dict[topics.Publication, Body]:
    """Return a message of every topic."""
    reply = cell.strike()
    plan, vector = cell.plan_of(reply), [0.1, 0.2, 0.3]
    cell.finish(reply)
    late: dict[str, Any] = {"code": "late", "message": "too late", "detail": {"goal_id": "late"}}
    pushed = m.ActiveDisturbance(kind="acceleration", values=[0.1] * len(cell.home), end_time=0.2)
    messages = {
        topics.STATE: cell.state(),
        topics.COMMAND: cell.commands()[-1],
        topics.PLAN: plan,
        topics.REFUSED: m.Refused(goal_id="late", client_id="", primitive="forehand", requested=1, **late),
        topics.STATUS: cell.status(),
        topics.ENDED: cell.result(reply.goal_id),
        topics.CONTACT: m.Contact(time=0.1, bodies=["racket", "ball"], impulse=0.1, ball_velocity=vector),
        topics.SCENE: m.Scene(time=0.1, joints={"finger": [0.02]}),
        topics.BALL: m.BallState(time=0.1, position=vector, velocity=vector),
        topics.DISTURBANCE: m.Disturbance(time=0.1, active=[pushed]),
        topics.STRIKES: m.Strike(ball=1, phase="seen", time=0.1),
    }
    cell.reset()
    return {topic: msgspec.to_builtins(message, builtin_types=(bytes,)) for topic, message in messages.items()}
