"""What holds for every plan: limits at all times, the extremes in its report, prescribed values, smooth joins."""

from itertools import pairwise

import numpy as np
from scipy.interpolate import BSpline, PPoly

from motion.limits import QUANTITIES
from motion.plan import SplinePlan
from motion.request import MotionRequest
from motion.trajectory import Trajectory
from tests.property.motion.in_seconds import curve_of

GRID = 2001
ROUNDING, TOUCH = 1e-10, 1e-6
"""Parts of a limit's range by which a curve may exceed it: anywhere, and where a prescribed value lies on it."""


def moving(planned: SplinePlan) -> np.ndarray:
    """Return all four quantities (4, n, J) of the moving part on a grid, at the knots, and at every extreme."""
    end = planned.request.moving_duration
    curve, t = curve_of(planned.control_points, end), [np.linspace(0, end, GRID)]
    t.append(np.unique(curve.t))
    for points in curve.c.T:
        pieces = PPoly.from_spline(BSpline(curve.t, points, curve.k))
        t += [pieces.derivative(order).roots(extrapolate=False) for order in range(1, 5)]
    instants = np.concatenate(t)
    # Of a piece that is constant, the roots are not a number.
    instants = instants[np.isfinite(instants)].clip(0, end)
    return np.array([curve(instants, order) for order in range(4)])


def behind(planned: SplinePlan) -> np.ndarray:
    """Return all four quantities (4, n, J) after the moving part, up to the last break."""
    start = planned.request.moving_duration
    motion, breaks = as_polynomials(planned.trajectory)
    later = np.concatenate([[start], breaks[breaks > start * (1 + 1e-12)]])
    # Without the ends of the pieces, at which jerk jumps.
    t = np.concatenate([[later[-1]], *(np.linspace(a, b, GRID)[1:-1] for a, b in pairwise(later))])
    return np.array([motion.derivative(order)(t) if order else motion(t) for order in range(4)])


def as_polynomials(trajectory: Trajectory) -> tuple[PPoly, np.ndarray]:
    """Return the trajectory as scipy's polynomials, and its breaks; pieces of no length are left out."""
    keep = np.diff(trajectory.breaks) > 0
    breaks = np.concatenate([trajectory.breaks[:-1][keep], trajectory.breaks[-1:]])
    return PPoly(trajectory.coefficients[keep].transpose(2, 0, 1)[::-1], breaks), breaks


def allowed(request: MotionRequest) -> np.ndarray:
    """Return the tolerance (J, 4) by which a quantity may exceed its limit."""
    ranges = request.limits.ranges
    width = np.ptp(ranges, axis=2)
    states = [(e.positions, e.velocities, e.accelerations) for e in (request.start, request.goal)]
    nothing = np.full(request.joint_count, np.nan)
    states += [(w.positions, w.velocities, nothing) for w in request.waypoints]
    straight = request.rest_fraction * request.duration * request.goal.velocities
    states += [(request.goal.positions - straight, nothing, request.final_accelerations)]
    fixed = np.array([[*state, nothing] for state in states]).transpose(2, 1, 0)  # (J, 4, F)
    apart = np.abs(fixed[..., None] - ranges[:, :, None]).min(axis=3)
    touching = (np.nan_to_num(apart, nan=np.inf) < 1e-6 * width[..., None]).any(axis=2)
    # On a limit a curve can only turn: its derivative is 0 there, and touches no limit of its own.
    return np.where(touching, TOUCH, ROUNDING) * width


def check_limits(planned: SplinePlan) -> None:
    """Check that no value exceeds its limit or the extremes in the report."""
    request, report = planned.request, planned.report
    slack = allowed(request)
    for values in (moving(planned), behind(planned)):
        for quantity, name in enumerate(QUANTITIES):
            low, high = request.limits.ranges[:, quantity].T
            curves, room = values[quantity], slack[:, quantity]
            assert np.all(curves <= high + room), (name, (curves - high).max(axis=0) / np.ptp([low, high], axis=0))
            assert np.all(curves >= low - room), (name, (low - curves).max(axis=0) / np.ptp([low, high], axis=0))
            lowest, highest = report.extremes[name].T
            hair = 2e-6 * np.ptp(curves, axis=0) + 1e-9 * (1 + np.abs(curves).max(axis=0))
            assert np.all(curves.max(axis=0) <= highest + hair), name
            assert np.all(curves.min(axis=0) >= lowest - hair), name


def check_extremes(planned: SplinePlan) -> None:
    """Check that the curve of a plan that coasts has the reported extremes, to 2e-6 of its spread."""
    values = moving(planned)
    for quantity, name in enumerate(QUANTITIES):
        curves = values[quantity]
        if planned.request.rest_fraction and quantity == 0:
            curves = np.concatenate([curves, planned.request.goal.positions[None]])
        lowest, highest = planned.report.extremes[name].T
        hair = 2e-6 * np.ptp(curves, axis=0) + 1e-12 * (1 + np.abs(curves).max(axis=0))
        assert np.all(np.abs(highest - curves.max(axis=0)) < hair), name
        assert np.all(np.abs(lowest - curves.min(axis=0)) < hair), name
        low, high = planned.request.limits.ranges[:, quantity].T
        assert np.array_equal(planned.report.margin[name], np.minimum(lowest - low, high - highest))


def check_prescribed_values(planned: SplinePlan) -> None:
    """Check that the plan meets the values of start, goal and waypoints."""
    request = planned.request
    times = [0.0, request.duration, request.moving_duration, *(w.time_from_start for w in request.waypoints)]
    got = planned.sample(np.array(times))

    def close(found: np.ndarray, wanted: np.ndarray, tolerance: float) -> None:
        assert np.all(np.isnan(wanted) | (np.abs(found - wanted) < tolerance))

    close(got.positions[0], request.start.positions, 1e-10)
    close(got.velocities[0], request.start.velocities, 1e-10)
    close(got.accelerations[0], request.start.accelerations, 1e-7)
    close(got.positions[1], request.goal.positions, 1e-9)
    close(got.velocities[1], request.goal.velocities, 1e-8)
    curve = curve_of(planned.control_points, request.moving_duration)
    close(curve(request.moving_duration, 2), request.final_accelerations, 1e-7)
    for k, waypoint in enumerate(request.waypoints, start=3):
        close(got.positions[k], waypoint.positions, 1e-9)
        close(got.velocities[k], waypoint.velocities, 1e-8)
    assert np.all(planned.report.final_error_positions < 1e-9)
    assert np.all(planned.report.final_error_velocities < 1e-8)


def check_joins(planned: SplinePlan) -> None:
    """Check that position, velocity and acceleration are equal on both sides of every break, and sampled exactly."""
    motion, breaks = as_polynomials(planned.trajectory)
    coefficients, lengths = motion.c[::-1], np.diff(breaks)
    for order in range(3):
        left = motion.derivative(order).c if order else motion.c
        reached = np.array([np.polyval(left[:, k], lengths[k]) for k in range(len(lengths))])
        begun = (1, 1, 2)[order] * coefficients[order]
        scale = np.abs(begun).max(axis=0) + 1.0
        assert np.all(np.abs(reached[:-1] - begun[1:]) < 1e-9 * scale), order
        if planned.request.tail == "stop" and order:  # the stop ends at rest by itself
            assert np.all(np.abs(reached[-1]) < 1e-8 * scale)
    fine = np.arange(0, planned.total_duration, 1e-4)
    sampled = planned.sample(fine)
    expected = np.array([motion.derivative(k)(fine) if k else motion(fine) for k in range(3)])
    inside = fine < breaks[-1]
    for found, wanted in zip((sampled.positions, sampled.velocities, sampled.accelerations), expected, strict=True):
        assert np.abs(found[inside] - wanted[inside]).max() < 1e-9 * (1 + np.abs(wanted[inside]).max())
    steps = np.abs(np.diff(sampled.accelerations[inside], axis=0))
    assert np.all(steps.max(axis=0) <= planned.request.limits.jerks * 1e-4 * (1 + 1e-5) + 1e-6)


def check_rest(planned: SplinePlan) -> None:
    """Check that the samples of a plan that stops end at rest on a tick."""
    samples = planned.samples()
    assert len(samples) == round(planned.total_duration / 0.001) + 1
    assert np.all(samples.velocities[-1] == 0)
    assert np.all(samples.accelerations[-1] == 0)
    assert planned.total_duration >= planned.trajectory.duration - 1e-9 * 0.001
