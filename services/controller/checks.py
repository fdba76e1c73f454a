"""Checks of a trajectory before the loop splices it."""

from dataclasses import dataclass

import numpy as np

from motion.limits import Limits
from motion.listing import listed
from motion.trajectory import Samples
from protocol import messages as m
from protocol.codec import bad_message, check_id
from protocol.errors import Refusal
from protocol.topics import MAX_PLAN_S
from robot.conversions import MATRICES, QUANTITY_OF, samples_of, unit_of
from robot.description import RobotConfig
from services.controller.pieces import check_pieces, check_rest
from services.controller.ranges import TIGHT, limit_refusal, return_ranges, return_ticks, slack
from services.controller.timeline import Segment


@dataclass(frozen=True, slots=True, eq=False)
class Checked:
    """A trajectory that is finite, smooth, inside the limits and ends at rest."""

    message: m.Trajectory
    segment: Segment


def check_trajectory(trajectory: m.Trajectory, config: RobotConfig) -> Checked:
    """Return the trajectory ready to be spliced.

    Raises:
        Refusal: `bad_message` if it is malformed, does not match this robot, jumps, or does not end at rest;
            `limit` if it exceeds the robot's limits, at a sample or, for `pieces`, at any time.
    """
    _check_frame(trajectory, config)
    pieces = _check_form(trajectory)
    samples = check_pieces(trajectory, pieces, config) if pieces else _check_samples(trajectory, config)
    return Checked(trajectory, Segment(round(trajectory.start_time * config.rate_hz), samples))


def _check_form(trajectory: m.Trajectory) -> m.Pieces | None:
    """Return the pieces, or None if the three matrices are given instead."""
    given = [name for name in MATRICES if getattr(trajectory, name) is not None]
    missing = [name for name in MATRICES if name not in given]
    pieces = trajectory.pieces or None
    if pieces is not None and given:
        raise bad_message("pieces", f"give either pieces or {', '.join(MATRICES)}; {given[0]} is there as well")
    if pieces is None and missing:
        raise bad_message(missing[0], f"{missing[0]} is missing; give {', '.join(MATRICES)}, or pieces")
    return pieces


def _check_samples(trajectory: m.Trajectory, config: RobotConfig) -> Samples:
    samples = samples_of(trajectory)
    _check_limits(samples, trajectory.hit_index, config)
    _check_smooth(samples, config)
    return _ending_at_rest(samples, config)


def _check_frame(trajectory: m.Trajectory, config: RobotConfig) -> None:
    if trajectory.joint_names != list(config.joint_names):
        raise bad_message("joint_names", f"joint_names must be those of the arm: {listed(config.joint_names)}")
    if abs(trajectory.dt * config.rate_hz - 1.0) > TIGHT:
        raise bad_message("dt", f"dt is {trajectory.dt} s; this robot ticks every {config.tick} s")
    longest = round(MAX_PLAN_S * config.rate_hz) + 1
    if not 1 <= trajectory.count <= longest:
        raise bad_message("count", f"count is {trajectory.count}; 1 to {longest} samples ({MAX_PLAN_S} s) are taken")
    if not 0 <= trajectory.hit_index < trajectory.count:
        raise bad_message("hit_index", f"hit_index is {trajectory.hit_index}; it must lie below count")
    if not 0 <= trajectory.start_time < 1e9:
        raise bad_message(
            "start_time", f"start_time is {trajectory.start_time} s; it must lie ahead on the arm's clock"
        )
    check_id("goal_id", trajectory.goal_id)
    if trajectory.client_id:
        check_id("client_id", trajectory.client_id)


def _check_limits(samples: Samples, hit_index: int, config: RobotConfig) -> None:
    limits: Limits = config.limits
    low, high = limits.positions.T
    lowest, highest = return_ranges(samples.positions[0], limits)
    back = return_ticks(hit_index)
    jerks = np.diff(samples.accelerations, axis=0) * config.rate_hz
    _check_range("position", samples.positions[:back], lowest, highest, config)
    _check_range("position", samples.positions[back:], low, high, config, back)
    _check_range("velocity", samples.velocities, -limits.velocities, limits.velocities, config)
    _check_range("acceleration", samples.accelerations, -limits.accelerations, limits.accelerations, config)
    _check_range("jerk", jerks, -limits.jerks, limits.jerks, config)


def _check_range(
    quantity: str, values: np.ndarray, low: np.ndarray, high: np.ndarray, config: RobotConfig, first: int = 0
) -> None:
    margin = slack(low, high)
    outside = (values < low - margin) | (values > high + margin)
    if not outside.any():
        return
    row, joint = np.argwhere(outside)[0]
    value, bounds = float(values[row, joint]), (float(low[joint]), float(high[joint]))
    raise limit_refusal(quantity, int(joint), value, bounds, f"sample {first + row}", config)


def _check_smooth(samples: Samples, config: RobotConfig) -> None:
    """Check that each column is the trapezoidal integral of the next, to the precision that the limits imply."""
    dt, limits = config.tick, config.limits
    for name, values, rates, bend in (
        (
            "positions",
            samples.positions,
            samples.velocities,
            np.minimum.reduce([dt**3 / 4 * limits.jerks, dt**2 / 4 * limits.accelerations, dt * limits.velocities]),
        ),
        (
            "velocities",
            samples.velocities,
            samples.accelerations,
            np.minimum.reduce([dt**2 / 2 * limits.jerks, dt * limits.accelerations, 2 * limits.velocities]),
        ),
    ):
        step = np.diff(values, axis=0) - dt / 2 * (rates[1:] + rates[:-1])
        jumps = np.argwhere(np.abs(step) > bend + 1e-9)
        if len(jumps):
            row, joint = jumps[0]
            unit = unit_of(QUANTITY_OF[name], config.slides[joint])
            sentence = f"{name} of {config.joint_names[joint]} jump by {step[row, joint]:.3g} {unit} after sample {row}"
            raise bad_message(name, f"{sentence}; they must be the integral of what follows them in the message")


def _ending_at_rest(samples: Samples, config: RobotConfig) -> Samples:
    """Return the samples with the last one exactly at rest, which it must be within rounding."""
    check_rest((samples.velocities[-1], samples.accelerations[-1]), config)
    velocities, accelerations = samples.velocities.copy(), samples.accelerations.copy()
    velocities[-1] = accelerations[-1] = 0.0
    return Samples(samples.positions, velocities, accelerations)


def check_continuity(reference: tuple[np.ndarray, ...], segment: Segment, config: RobotConfig) -> None:
    """Check that the first sample continues the `reference` (positions, velocities, accelerations).

    Raises:
        Refusal: `invalid_goal`, naming the joint that would jump.
    """
    samples = segment.samples
    first = samples.positions[0], samples.velocities[0], samples.accelerations[0]
    fields = ("positions", TIGHT), ("velocities", TIGHT * 1e2), ("accelerations", TIGHT * 1e4)
    for (field, tolerance), ours, theirs in zip(fields, reference, first, strict=True):
        gap = np.abs(ours - theirs)
        joint = int(np.argmax(gap))
        if gap[joint] > tolerance:
            unit = unit_of(QUANTITY_OF[field], config.slides[joint])
            sentence = (
                f"{field} of {config.joint_names[joint]} begin at {theirs[joint]:.6g} {unit}, the reference is at "
                f"{ours[joint]:.6g} {unit} then; ask `reference` where to begin"
            )
            raise Refusal("invalid_goal", sentence, field=field)
