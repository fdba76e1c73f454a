"""Plans by the paper's own formulation: PIQP solves the complete quadratic program of `motion.gaussian_program`.

The limits are not guaranteed between the instants at which they are imposed: see `motion.sampled.check_limits`.
"""

import numpy as np
import piqp

from motion.errors import SolverFailed
from motion.gaussian_program import INSTANTS, GaussianProgram, make_programs, rows
from motion.primitive import Primitive
from motion.program.contradiction import InfeasibleRows, hardest_limit
from motion.program.least_distance import make_solver
from motion.program.report import Distance
from motion.request import MotionRequest
from motion.sampled import SampledPlan, make_plan
from motion.trajectory import Trajectory, quintic

BASIS_COUNT = 50
"""Number of Gaussians."""

SAFETY_MARGIN = 1e-3
"""With this `margin` most motions that run along a limit also keep it between the instants; without one, few do."""

TOLERANCES = 1e-9, 1e-7
"""Solver tolerances, relative to the largest weight of the motion without limits. The second is tried if the first
fails."""

EQUALITY_TOLERANCE = 1e-9
"""Largest residual of an equality, relative to the largest target."""

ELSEWHERE = "this method looks for no other duration; method 'qp' names one that works"


def plan_gaussian(
    primitive: Primitive, request: MotionRequest, tick: float = 0.001, margin: float = 0.0
) -> SampledPlan:
    """Plan as the paper does.

    margin: safety margin inside the limits (section IV-B), as a part of half their range; use SAFETY_MARGIN for motions
    that are played. The played motion consists of quintics between the instants. The stop begins at the goal.

    Raises:
        InvalidMotion, LimitExceeded, CannotStop: as `motion.plan.plan`; InvalidMotion also for a place time.
        Infeasible: no motion keeps the limits; this method searches no other duration.
        SolverFailed: the solver failed numerically.
    """
    primitive.check_joints(request.joint_count)
    request = request.clipped()
    programs = make_programs(primitive, request, BASIS_COUNT, margin)
    weights, unlimited = np.empty((2, len(programs), BASIS_COUNT))
    for joint, program in enumerate(programs):
        try:
            unlimited[joint] = optimum_without_limits(program)
        except np.linalg.LinAlgError:
            raise SolverFailed(joint, "the fixed values depend on each other") from None
        try:
            weights[joint] = optimum(program, joint)
        except InfeasibleRows as failed:
            raise failed.error(request, otherwise=ELSEWHERE) from None
        missed = np.abs(program.A @ weights[joint] - program.b)
        if (missed > EQUALITY_TOLERANCE * max(1.0, np.abs(program.b).max())).any():
            raise SolverFailed(joint, f"equalities are off by {missed.max():.1e}")
    states = _states(programs, weights, request.moving_duration)
    step = request.moving_duration * INSTANTS[1]
    moving = Trajectory(request.moving_duration * INSTANTS, quintic(states[:, :-1], states[:, 1:], step))
    by_limits = Distance.of((weights - unlimited) @ rows(BASIS_COUNT)[0].T)
    return make_plan(primitive, request, moving, tick, BASIS_COUNT, by_limits)


def optimum_without_limits(program: GaussianProgram) -> np.ndarray:
    """Weights (N,) that minimise the cost under the equalities alone, from the KKT system."""
    m = len(program.b)
    kkt = np.block([[program.P, program.A.T], [program.A, np.zeros((m, m))]])
    return np.linalg.solve(kkt, np.concatenate([-program.c, program.b]))[: len(program.c)]


def optimum(program: GaussianProgram, joint: int) -> np.ndarray:
    """Weights (N,) that minimise the cost under all constraints.

    joint: for the errors. Raises InfeasibleRows or SolverFailed.
    """
    nearest = optimum_without_limits(program)
    reached = program.G @ nearest
    if ((program.low <= reached) & (reached <= program.high)).all():
        return nearest
    # In units of the largest weight, so that tolerances are relative.
    size = max(np.abs(nearest).max(), 1e-6)
    status = piqp.PIQP_UNSOLVED
    for tolerance in TOLERANCES:
        solver = make_solver(tolerance, tolerance)
        bounds = program.low / size, program.high / size
        solver.setup(program.P, program.c / size, program.A, program.b / size, np.asfortranarray(program.G), *bounds)
        status = solver.solve()
        if status == piqp.PIQP_PRIMAL_INFEASIBLE:
            quantity, s = hardest_limit(program.quantity, program.s, solver.result.z_u + solver.result.z_l)
            raise InfeasibleRows(joint, quantity, s)
        w = size * solver.result.x
        if status == piqp.PIQP_SOLVED and np.isfinite(w).all():
            # Correct the weights so that the equalities hold to rounding.
            return w + np.linalg.lstsq(program.A, program.b - program.A @ w)[0]
    raise SolverFailed(joint, status.name)


def _states(programs: list[GaussianProgram], weights: np.ndarray, duration: float) -> np.ndarray:
    """Positions, velocities and accelerations (3, 1001, J) at the instants of a motion of `duration` s."""
    states = rows(weights.shape[1])[:3] @ weights.T
    place, speed = np.array([program.start for program in programs]).T
    states[0] += place + speed * INSTANTS[:, None]
    states[1] += speed
    return states / duration ** np.arange(3.0)[:, None, None]
