"""Plans without a guarantee between samples: motions of the methods "gaussian" and "dmp".

Their report gives the extremes they reach. `check_limits` refuses plans that exceed the limits; it checks the played
polynomials.
"""

from dataclasses import dataclass

import numpy as np
from scipy.integrate import simpson

from motion.errors import PlanExceeds
from motion.limits import QUANTITIES
from motion.plan import Plan
from motion.primitive import Primitive
from motion.program.curves import curves_along, extremes
from motion.program.ending import ending
from motion.program.report import Distance, Report, reached
from motion.request import Boundary, MotionRequest
from motion.trajectory import ARRIVED, Trajectory

COMPARED = 2001
"""Number of instants at which a motion is compared with its demonstration."""


@dataclass(frozen=True, eq=False)
class SampledPlan(Plan):
    """A motion whose limits are not guaranteed between its samples.

    pieces: the moving part, in pieces of equal length.
    """

    pieces: Trajectory

    @property
    def moving(self) -> Trajectory:
        """The part that imitates the demonstration."""
        return self.pieces


def check_limits(plan: SampledPlan) -> None:
    """Raise PlanExceeds for the first limit that the plan exceeds by more than rounding."""
    reached = np.concatenate([plan.report.extremes[name] for name in QUANTITIES], axis=1).T
    if error := plan.request.limits.exceeded(np.repeat(np.arange(len(QUANTITIES)), 2), reached):
        raise PlanExceeds(error.joint, error.quantity, error.value, error.bound)


def make_plan(
    primitive: Primitive, request: MotionRequest, moving: Trajectory, tick: float, basis_count: int, by_limits: Distance
) -> SampledPlan:
    """Return the plan of a motion, with a report of its extremes and errors; its limits are not certified.

    moving: the moving part, in pieces of equal length; the ending begins in its final state. by_limits: distance from
    the motion without limits.
    """
    last = moving.sample(moving.breaks[-1:])
    end = ending(request, Boundary(last.positions[0], last.velocities[0], last.accelerations[0]))
    hit = moving.duration + request.rest_fraction * request.duration
    trajectory, s = moving.then(end.trajectory()), np.linspace(0, 1, COMPARED)
    # The last instant belongs to the moving part: the ending may begin with another acceleration.
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
