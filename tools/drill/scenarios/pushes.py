"""Pushes, a recoil, saturated torques, an obstacle, a joint stop: the arm recovers, or faults with a reason."""

import shutil
from pathlib import Path

import numpy as np

from deploy.demonstrations.make_forehand import HIT
from protocol import messages as m
from protocol import topics
from robot.dynamics import load_at
from robot.kinematics import Kinematics
from robot.model import joint_ids
from tools.drill.harness.cell import Cell
from tools.drill.harness.lab import Lab
from tools.drill.harness.start import CellConfig
from tools.drill.scenario import Measured, Scenario, at_least, at_most, exactly, none, reported

RECOVERED = 1e-3
"""Largest tracking error, rad, of an arm that has recovered."""

STOP_COMPLIANCE = 0.05
"""Largest travel, rad, beyond a joint stop, which is compliant in the model."""

UNLOAD_S = 0.1
"""Time after a fault until the arm no longer presses on an obstacle."""

POST = '<geom name="post" type="box" size="0.03 0.03 0.6" pos="{} {} {}" contype="0" conaffinity="3"/>'


def push(cell: Cell, values: list[float], start: float, duration: float) -> None:
    """Disturb the joints with accelerations (J,), rad/s², from `start` for `duration`, s."""
    request = m.Disturb(kind="acceleration", values=values, start_time=start, duration=duration)
    cell.bus.ask(topics.SIM_DISTURB, request)


def on_joint_1(cell: Cell, value: float) -> list[float]:
    """Return a vector with `value` for joint_1 and zero for the other joints."""
    return [value, *[0.0] * (len(cell.home) - 1)]


def end(cell: Cell) -> Measured:
    """Return the measurements of the arm's state, recovered or in fault, and reset a fault."""
    status = cell.status()
    off = max(map(abs, status.error.positions))
    if status.fault:
        cell.bus.ask(topics.RESET, m.Empty())
        cell.step(50)
    return {
        "state at the end": "in fault" if status.fault else "recovered" if off < RECOVERED else f"{off:.3g} rad off",
        "neither recovered nor in fault": int(not status.fault and off >= RECOVERED),
        "reason of the fault": status.fault or "",
        "saturated ticks": sum(any(state.saturated) for state in cell.states()),
    }


def play(cell: Cell) -> Measured:
    """Play a goal to home, and return its outcome."""
    return {"outcome of the next goal": cell.finish(cell.goal()).outcome}


def push_in_strike(lab: Lab, acceleration: float) -> Measured:
    """Push joint_1 for 0.2 s during a strike, as in the paper."""
    cell = lab.shared_cell()
    reply = cell.strike()
    push(cell, on_joint_1(cell, acceleration), reply.start_time + 0.1, 0.2)
    cell.step_to(cell.end_tick(reply) + 600)
    result = cell.result(reply.goal_id)
    return {
        "outcome of the goal": result.outcome,
        "peak tracking error": result.peak_tracking_error,
        **end(cell),
        **play(cell),
    }


def push_at_hit(lab: Lab) -> Measured:
    """Push joint_1 back at the hit, as a ball does, by more than `max_tracking_error`."""
    cell = lab.shared_cell()
    reply = cell.strike()
    push(cell, on_joint_1(cell, -400.0), reply.start_time + reply.duration, 0.06)
    cell.step_to(cell.end_tick(reply) + 600)
    result = cell.result(reply.goal_id)
    recoil = result.recoil
    commanded = np.array([command.accelerations for command in cell.commands()])
    return {
        "outcome of the goal": result.outcome,
        "peak error of the recoil": recoil.peak_error if recoil else 0.0,
        "duration of the recoil": recoil.back_time - recoil.time if recoil and recoil.back_time else np.inf,
        "largest commanded acceleration, fraction of the limit": float(
            np.abs(commanded / cell.config.limits.accelerations).max()
        ),
        **end(cell),
        **play(cell),
    }


def touch_limit(lab: Lab) -> Measured:
    """Push joint_1 against its stop."""
    cell = lab.shared_cell()
    top = float(cell.config.limits.positions[0, 1])
    cell.reset(positions=[top - 0.02, *cell.home[1:]])
    cell.step(10)
    push(cell, on_joint_1(cell, 300.0), 0.02, 0.1)
    cell.step(1000)
    beyond = max(state.positions[0] for state in cell.states()) - top
    return {"largest travel beyond the joint range": max(0.0, beyond), **end(cell), **play(cell)}


def hit_post(lab: Lab) -> Measured:
    """Strike with a post in the path of the racket; the goal turns off the planner's collision check."""
    config = post_in_the_way(lab)
    with lab.cell(CellConfig(robot_config=config)) as cell:
        cell.reset()
        reply = cell.strike(checks=m.Checks(collision=False))
        cell.step_to(cell.end_tick(reply) + 1500)
        result = cell.result(reply.goal_id)
        touch = result.first_contact
        return {
            "outcome of the goal": result.outcome,
            "first contact": f"{touch.body} with {touch.other}" if touch else "none",
            "torque besides gravity's, from 100 ms after the fault, fraction of the limit": torque_left(
                cell, reply, cell.ticks(UNLOAD_S)
            ),
            **end(cell),
        }


def torque_left(cell: Cell, reply: m.GoalReply, ticks: int) -> float:
    """Return the largest torque besides gravity's from `ticks` after the fault, as a fraction of its limit."""
    fault = max(command.tick for command in cell.commands() if command.goal_id == reply.goal_id) + 1
    states = [state for state in cell.states() if state.tick > fault + ticks]
    config, model = cell.config, cell.config.load_model()
    joints, poses = joint_ids(model, config.joint_names), np.array([state.positions for state in states])
    gravity = load_at(model, config.pose_at_home, joints, poses).gravity
    return float((np.abs(np.array([state.torques for state in states]) - gravity) / config.torques).max())


def post_in_the_way(lab: Lab) -> Path:
    """Write the robot's description with a post where the racket is 0.3 rad before the hit; return the file."""
    source = lab.options.robot_config
    cell_config = lab.config
    place, _ = Kinematics(cell_config).tool_pose(np.array([HIT[0] - 0.3, *HIT[1:]]))
    folder = lab.folder / "post"
    folder.mkdir(exist_ok=True)
    shutil.copy(source, folder / source.name)
    model = cell_config.mjcf_path
    post = POST.format(*place)
    (folder / model.name).write_text(model.read_text().replace("</worldbody>", f"{post}</worldbody>"))
    return folder / source.name


ENDS = (reported("state at the end"), reported("reason of the fault"), none("neither recovered nor in fault"))
NEXT_SUCCEEDS = exactly("outcome of the next goal", "succeeded")

SCENARIOS = (
    Scenario(
        "push",
        "a push of 100 rad/s² for 0.2 s during a strike",
        (
            at_least("peak tracking error", 0.05, "rad"),
            exactly("outcome of the goal", "succeeded"),
            exactly("state at the end", "recovered"),
            NEXT_SUCCEEDS,
        ),
        lambda lab: push_in_strike(lab, 100.0),
    ),
    Scenario(
        "recoil",
        "a push of −400 rad/s² for 0.06 s at the hit of a strike",
        (
            at_least("peak error of the recoil", 0.3, "rad"),
            at_most("duration of the recoil", 0.4, "s"),
            at_most("largest commanded acceleration, fraction of the limit", 1.0),
            exactly("outcome of the goal", "succeeded"),
            exactly("state at the end", "recovered"),
            NEXT_SUCCEEDS,
        ),
        push_at_hit,
    ),
    Scenario(
        "saturation",
        "a push of 1000 rad/s² for 0.2 s, more than the torque limits can resist",
        (at_least("saturated ticks", 1), exactly("outcome of the goal", "aborted"), *ENDS, NEXT_SUCCEEDS),
        lambda lab: push_in_strike(lab, 1000.0),
    ),
    Scenario(
        "joint-end",
        "joint_1 pushed with 300 rad/s² against the end of its range",
        (
            at_least("largest travel beyond the joint range", 1e-3, "rad"),
            at_most("largest travel beyond the joint range", STOP_COMPLIANCE, "rad"),
            *ENDS,
            NEXT_SUCCEEDS,
        ),
        touch_limit,
    ),
    Scenario(
        "obstacle",
        "a post in the path of the racket",
        (
            exactly("outcome of the goal", "aborted"),
            exactly("first contact", "racket with post"),
            at_most("torque besides gravity's, from 100 ms after the fault, fraction of the limit", 0.1),
            *ENDS,
        ),
        hit_post,
    ),
)
