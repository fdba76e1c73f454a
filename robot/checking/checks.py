"""The checks of a robot, and the cost of its simulation."""

import resource
import time
from dataclasses import dataclass

import mujoco

from robot.checking import numbers, structure
from robot.checking.subject import Finding, Subject
from robot.description import RobotConfig

CHECKS = (
    structure.contacts_at_home,
    structure.restraints,
    structure.undriven,
    structure.order,
    structure.urdf_limits,
    structure.unnamed_bodies,
    structure.shapes,
    structure.margin,
    numbers.gravity,
    numbers.friction,
    numbers.gain,
    numbers.missing_limits,
    numbers.swapped_ranges,
    numbers.degrees,
)
LEVELS = "unusable", "warning", "note"
STEPS = 300
BUSY = 0.5
"""Largest fraction of a tick that the simulation may take."""


def check_robot(config: RobotConfig, model: mujoco.MjModel) -> list[Finding]:
    """Return the faults of a robot, the worst first. Takes about 20 ms for six joints."""
    subject = Subject(config, model)
    findings = [finding for check in CHECKS for finding in check(subject)]
    return sorted(findings, key=lambda finding: LEVELS.index(finding.level))


@dataclass(frozen=True, slots=True)
class Cost:
    """Memory and time that simulating the robot takes.

    Attributes:
        model_bytes: Size of the compiled model and its data.
        peak_bytes: Peak memory of this process so far, including compilation.
        step_s: Duration of a physics step at home, without the bus, s.
    """

    model_bytes: int
    peak_bytes: int
    step_s: float


def measure_cost(config: RobotConfig, model: mujoco.MjModel) -> Cost:
    """Return the cost of a robot; this simulates some steps."""
    data = mujoco.MjData(model)
    data.qpos[:] = config.pose_at_home
    mujoco.mj_step(model, data)
    began = time.perf_counter()
    for _ in range(STEPS):
        mujoco.mj_step(model, data)
    step_s = (time.perf_counter() - began) / STEPS
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
    return Cost(int(model.nbuffer + data.nbuffer + data.narena), peak, step_s)


def cost_finding(config: RobotConfig, cost: Cost) -> Finding:
    """Return the cost as a sentence."""
    sentence = (
        f"a physics step takes {cost.step_s * 1e6:.0f} µs of a tick of {config.tick * 1e6:.0f} µs; the model takes "
        f"{cost.model_bytes / 1e6:.0f} MB, and {cost.peak_bytes / 1e6:.0f} MB while it is compiled"
    )
    if cost.step_s > BUSY * config.tick:
        return Finding("warning", f"{sentence}. Lower rate_hz, or give the links simpler collision geometry")
    return Finding("note", sentence)
