"""Plans without a certificate: motions of method "gaussian" and "dmp", which promise nothing between their samples.

Their report says how far they reach, and `check_limits` refuses what leaves the limits: what is checked are the
polynomials that are played.
"""

from dataclasses import dataclass

import numpy as np
from scipy.integrate import simpson

from motion.limits import QUANTITIES
from motion.plan import Plan
from motion.primitive import Primitive
from motion.program.curves import curves_along, extremes
from motion.program.ending import ending
from motion.program.report import Distance, Report, reached
from motion.request import Boundary, MotionRequest
from motion.trajectory import ARRIVED, Trajectory

COMPARED = 2001
"""Instants at which a motion is compared with its demonstration."""


@dataclass(frozen=True, eq=False)
class SampledPlan(Plan):
    """A motion that promises nothing between its samples.

    pieces: the moving part, of equal length.
    """

    pieces: Trajectory

    @property
    def moving(self) -> Trajectory:
        """The part that imitates the demonstration."""
        return self.pieces


def check_limits(plan: SampledPlan) -> None:
    """Raise LimitExceeded for the first limit that the plan leaves by more than rounding."""
    reached = np.concatenate([plan.report.extremes[name] for name in QUANTITIES], axis=1).T
    if error := plan.request.limits.exceeded(np.repeat(np.arange(len(QUANTITIES)), 2), reached):
        raise error


def make_plan(
    primitive: Primitive, request: MotionRequest, moving: Trajectory, tick: float, basis_count: int, by_limits: Distance
) -> SampledPlan:
    """Return the plan of a motion, with what it reaches and misses; nothing is certified.

    moving: the moving part, in pieces of equal length; what follows begins in the state in which it ends.
    by_limits: distance from the motion without limits.
    """
    last = moving.sample(moving.breaks[-1:])
    end = ending(request, Boundary(last.positions[0], last.velocities[0], last.accelerations[0]))
    hit = moving.duration + request.rest_fraction * request.duration
    trajectory, s = moving.then(end.trajectory()), np.linspace(0, 1, COMPARED)
    # The last instant belongs to the motion, not to its tail, whose acceleration may be another.
    played = trajectory.sample(np.minimum(s * hit, hit - 2 * ARRIVED))
    shown = primitive.sample(request.phase + (1 - request.phase) * s)
    at_hit = trajectory.sample(np.array([hit]))
    tau = (1 - request.phase) * primitive.duration / hit
    missed = played.accelerations - tau**2 * shown.accelerations
    report = Report(
        imitation_rms=np.sqrt(simpson(missed**2, x=s, axis=0)),
        final_error_positions=np.abs(at_hit.positions[0] - request.goal.positions),
        final_error_velocities=np.abs(at_hit.velocities[0] - request.goal.velocities),
        **reached(extremes(curves_along(moving), moving.duration), end),
        active=(),
        from_demonstration=Distance.of((played.positions - shown.positions).T),
        by_limits=by_limits,
        phase=request.phase,
        basis_count=basis_count,
        certified=False,
        rounds=0,
        rows=0,
    )
    return SampledPlan(request, end, hit, tick, report, moving)
