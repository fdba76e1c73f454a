"""Pushes, a recoil, saturated torques, an obstacle, the end of a joint: the arm recovers, or faults with a reason."""

import shutil
from pathlib import Path

import numpy as np

from deploy.demonstrations.make_forehand import HIT
from protocol import messages as m
from protocol import topics
from robot.kinematics import Kinematics
from tools.drill.harness.cell import Cell
from tools.drill.harness.lab import Lab
from tools.drill.harness.start import CellConfig
from tools.drill.scenario import Measured, Scenario, at_least, at_most, exactly, none, reported

RECOVERED = 1e-3
"""rad; a pushed arm has recovered within this of its reference."""

GIVE = 0.05
"""rad; largest travel beyond the end of a joint, which is soft in the model."""

PRESSES_S = 0.1
"""After this time the arm presses no longer."""

POST = '<geom name="post" type="box" size="0.03 0.03 0.6" pos="{} {} {}" contype="0" conaffinity="3"/>'


def push(cell: Cell, values: list[float], start: float, duration: float) -> None:
    """Push with accelerations, rad/s² a joint."""
    request = m.Disturb(kind="acceleration", values=values, start_time=start, duration=duration)
    cell.bus.ask(topics.SIM_DISTURB, request)


def one(cell: Cell, value: float) -> list[float]:
    """Return `value` for joint_1 and zero for the others."""
    return [value, *[0.0] * (len(cell.home) - 1)]


def end(cell: Cell) -> Measured:
    """Return how the run ended, recovered or in a fault; leave the fault."""
    status = cell.status()
    off = max(map(abs, status.error.positions))
    if status.fault:
        cell.bus.ask(topics.RESET, m.Empty())
        cell.step(50)
    return {
        "the arm": "in a fault" if status.fault else "recovered" if off < RECOVERED else f"{off:.3g} rad off",
        "neither recovered nor in a fault with a reason": int(not status.fault and off >= RECOVERED),
        "reason of the fault": status.fault or "",
        "ticks saturated": sum(any(state.saturated) for state in cell.states()),
    }


def play(cell: Cell) -> Measured:
    """Play a goal to home."""
    return {"the next goal": cell.finish(cell.goal()).outcome}


def push_in_strike(lab: Lab, acceleration: float) -> Measured:
    """Push joint_1 for 0.2 s in a strike, as in the paper."""
    cell = lab.shared()
    reply = cell.strike()
    push(cell, one(cell, acceleration), reply.start_time + 0.1, 0.2)
    cell.step_to(cell.end_tick(reply) + 600)
    result = cell.result(reply.goal_id)
    return {"the goal": result.outcome, "peak tracking error": result.peak_tracking_error, **end(cell), **play(cell)}


def push_at_hit(lab: Lab) -> Measured:
    """Push joint_1 back at the hit, as a ball does, farther than `max_tracking_error`."""
    cell = lab.shared()
    reply = cell.strike()
    push(cell, one(cell, -400.0), reply.start_time + reply.duration, 0.06)
    cell.step_to(cell.end_tick(reply) + 600)
    result = cell.result(reply.goal_id)
    recoil = result.recoil
    commanded = np.array([command.accelerations for command in cell.commands()])
    return {
        "the goal": result.outcome,
        "recoil": recoil.peak_error if recoil else 0.0,
        "back after": recoil.back_time - recoil.time if recoil and recoil.back_time else np.inf,
        "accelerations commanded": float(np.abs(commanded / cell.config.limits.accelerations).max()),
        **end(cell),
        **play(cell),
    }


def touch_limit(lab: Lab) -> Measured:
    """Push joint_1 against the end of its range."""
    cell = lab.shared()
    top = float(cell.config.limits.positions[0, 1])
    cell.reset(positions=[top - 0.02, *cell.home[1:]])
    cell.step(10)
    push(cell, one(cell, 300.0), 0.02, 0.1)
    cell.step(1000)
    beyond = max(state.positions[0] for state in cell.states()) - top
    return {"beyond the range by": max(0.0, beyond), **end(cell), **play(cell)}


def hit_post(lab: Lab) -> Measured:
    """Strike with a post in the way of the racket, of which the planner is asked to take no notice."""
    config = post_in_the_way(lab)
    with lab.cell(CellConfig(robot_config=config)) as cell:
        cell.reset()
        reply = cell.strike(checks=m.Checks(collision=False))
        cell.step_to(cell.end_tick(reply) + 1500)
        result = cell.result(reply.goal_id)
        touch = result.first_contact
        return {
            "the goal": result.outcome,
            "first contact": f"{touch.body} with {touch.other}" if touch else "none",
            "torque from 100 ms after the fault on, beyond that at rest": torque_left(
                cell, reply, cell.ticks(PRESSES_S)
            ),
            **end(cell),
        }


def torque_left(cell: Cell, reply: m.GoalReply, ticks: int) -> float:
    """Return by how much torques exceed those at rest, from `ticks` after the fault on; as a part of their limits."""
    fault = max(command.tick for command in cell.commands() if command.goal_id == reply.goal_id) + 1
    torques = np.abs([state.torques for state in cell.states() if state.tick > fault + ticks])
    return float(((torques - torques[-1]) / cell.config.torques).max())


def post_in_the_way(lab: Lab) -> Path:
    """Write the robot's description with a post where the racket passes 0.3 rad before the hit; return it."""
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


ENDS = (reported("the arm"), reported("reason of the fault"), none("neither recovered nor in a fault with a reason"))
GOES_ON = exactly("the next goal", "succeeded")

SCENARIOS = (
    Scenario(
        "push",
        "a push of 100 rad/s² for 0.2 s in a strike",
        "stepped",
        (
            at_least("peak tracking error", 0.05, "rad"),
            exactly("the goal", "succeeded"),
            exactly("the arm", "recovered"),
            GOES_ON,
        ),
        lambda lab: push_in_strike(lab, 100.0),
    ),
    Scenario(
        "recoil",
        "a push of −400 rad/s² for 0.06 s at the hit of a strike",
        "stepped",
        (
            at_least("recoil", 0.3, "rad"),
            at_most("back after", 0.4, "s"),
            at_most("accelerations commanded", 1.0, "of the limit"),
            exactly("the goal", "succeeded"),
            exactly("the arm", "recovered"),
            GOES_ON,
        ),
        push_at_hit,
    ),
    Scenario(
        "saturation",
        "a push of 1000 rad/s² for 0.2 s, more than the torques can hold",
        "stepped",
        (at_least("ticks saturated", 1), exactly("the goal", "aborted"), *ENDS, GOES_ON),
        lambda lab: push_in_strike(lab, 1000.0),
    ),
    Scenario(
        "joint-end",
        "joint_1 pushed with 300 rad/s² against the end of its range",
        "stepped",
        (at_least("beyond the range by", 1e-3, "rad"), at_most("beyond the range by", GIVE, "rad"), *ENDS, GOES_ON),
        touch_limit,
    ),
    Scenario(
        "obstacle",
        "a post in the way of the racket",
        "stepped",
        (
            exactly("the goal", "aborted"),
            exactly("first contact", "racket with post"),
            at_most("torque from 100 ms after the fault on, beyond that at rest", 0.1, "of the limit"),
            *ENDS,
        ),
        hit_post,
    ),
)
