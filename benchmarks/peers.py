"""Other solvers on the full problem, and planners that solve a part of it.

The full problem is the paper's eq. 17 in the weights of one joint's Gaussians, with all limits at 1001 instants. Its
matrices are built once; a goal only changes right-hand sides.
"""

from collections.abc import Callable
from ctypes import c_int

import clarabel
import cvxopt
import cvxopt.solvers
import daqp
import numpy as np
import piqp
import ruckig
from movement_primitives.dmp import DMPWithFinalVelocity
from scipy import sparse
from scipy.integrate import simpson

from motion.gaussian_basis import make_basis
from motion.primitive import Primitive
from motion.request import MotionRequest

cvxopt.solvers.options["show_progress"] = False

Answer = np.ndarray | None
"""Weights (N,) or accelerations (n,) equally spaced over the motion, rad/s²; None if nothing was found."""


class FullProblem:
    """min wᵀΨw − 2θᵀw with equalities and 4004 two-sided rows, in the form of each solver."""

    def __init__(self, primitive: Primitive, basis_count: int = 50) -> None:
        basis, s = make_basis(basis_count), np.linspace(0, 1, 1001)
        fine = np.linspace(0, 1, 4001)
        shown = primitive.duration**2 * primitive.sample(fine).accelerations
        theta = np.asarray(simpson(basis.rows(fine, 0) * shown, x=fine, axis=0))
        self.rows = np.concatenate([basis.rows(s, order) for order in (-2, -1, 0, 1)])
        self.equalities = np.array([self.rows[1000], self.rows[2001], self.rows[2002]])
        self.hessian, self.linear = 2 * basis.gram(), -2 * theta
        both = np.vstack([self.rows, -self.rows])
        self._cvxopt = [cvxopt.matrix(x) for x in (self.hessian, self.linear, both, self.equalities)]
        self._piqp = [np.asfortranarray(x) for x in (self.hessian, self.equalities, self.rows)]
        self._daqp = np.ascontiguousarray(np.vstack([self.equalities, self.rows]))
        self._clarabel = sparse.triu(self.hessian, format="csc"), sparse.csc_matrix(np.vstack([self.equalities, both]))

    def sides(self, request: MotionRequest) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return targets (3,), lower and upper sides (4004,), for a start at rest without acceleration."""
        duration, start = request.duration, request.start.positions[0]
        ranges = request.limits.ranges[0] * duration ** np.arange(4.0)[:, None]
        ranges[0] -= start
        targets = np.array([request.goal.positions[0] - start, duration * request.goal.velocities[0], 0.0])
        return targets, np.repeat(ranges[:, 0], 1001), np.repeat(ranges[:, 1], 1001)

    def cvxopt(self, request: MotionRequest) -> np.ndarray | None:
        """Solve by CVXOPT, the paper's solver."""
        targets, lower, upper = self.sides(request)
        hessian, linear, rows, equalities = self._cvxopt
        sides = cvxopt.matrix(np.concatenate([upper, -lower]))
        found = cvxopt.solvers.qp(hessian, linear, rows, sides, equalities, cvxopt.matrix(targets))
        return np.array(found["x"])[:, 0] if found["status"] == "optimal" else None

    def piqp(self, request: MotionRequest) -> np.ndarray | None:
        """Solve by PIQP, dense."""
        targets, lower, upper = self.sides(request)
        hessian, equalities, rows = self._piqp
        solver = piqp.DenseSolver()
        solver.setup(hessian, self.linear, equalities, targets, rows, lower, upper)
        return solver.result.x.copy() if solver.solve() == piqp.PIQP_SOLVED else None

    def daqp(self, request: MotionRequest) -> np.ndarray | None:
        """Solve by DAQP, cold."""
        targets, lower, upper = self.sides(request)
        sense = np.zeros(len(lower) + 3, dtype=c_int)
        sense[:3] = 5
        high, low = np.concatenate([targets, upper]), np.concatenate([targets, lower])
        weights, _, flag, _ = daqp.solve(self.hessian, self.linear, self._daqp, high, low, sense)
        return weights if flag >= 1 else None

    def clarabel(self, request: MotionRequest) -> np.ndarray | None:
        """Solve by Clarabel, which is designed for sparse problems; this problem is dense."""
        targets, lower, upper = self.sides(request)
        settings = clarabel.DefaultSettings()  # pyright: ignore[reportAttributeAccessIssue]
        settings.verbose = False
        hessian, rows = self._clarabel
        sides = np.concatenate([targets, upper, -lower])
        cones = [clarabel.ZeroConeT(3), clarabel.NonnegativeConeT(len(sides) - 3)]  # pyright: ignore[reportAttributeAccessIssue]
        found = clarabel.DefaultSolver(hessian, self.linear, rows, sides, cones, settings).solve()  # pyright: ignore[reportAttributeAccessIssue]
        return np.array(found.x) if str(found.status) == "Solved" else None


def ruckig_motion(request: MotionRequest) -> Answer:
    """Plan by Ruckig, from start to goal in the duration.

    It keeps velocity, acceleration and jerk limits, but no position limits; it imitates nothing and ends with zero
    acceleration.
    """
    wanted = ruckig.InputParameter(1)
    start, goal, limits = request.start, request.goal, request.limits
    wanted.current_position, wanted.target_position = start.positions.tolist(), goal.positions.tolist()
    wanted.target_velocity = goal.velocities.tolist()
    wanted.max_velocity, wanted.max_acceleration = limits.velocities.tolist(), limits.accelerations.tolist()
    wanted.max_jerk = limits.jerks.tolist()
    wanted.minimum_duration = request.duration
    trajectory = ruckig.Trajectory(1)
    try:
        outcome = ruckig.Ruckig(1).calculate(wanted, trajectory)
    except ruckig.RuckigError:
        return None
    if outcome not in (ruckig.Result.Working, ruckig.Result.Finished) or trajectory.duration > request.duration + 1e-6:
        return None
    return np.array([trajectory.at_time(t)[2][0] for t in np.linspace(0, request.duration, 1001)])


def dmp_solver(primitive: Primitive) -> Callable[[MotionRequest], Answer]:
    """Learn DMPWithFinalVelocity, which imitates and reaches the final velocity, but has no limits."""
    duration = primitive.duration
    s = np.linspace(0, 1, 1001)
    learned = DMPWithFinalVelocity(n_dims=1, execution_time=duration, dt=duration / 1000, n_weights_per_dim=50)
    learned.imitate(s * duration, primitive.positions(s))

    def solve(request: MotionRequest) -> Answer:
        learned.configure(
            start_y=request.start.positions, goal_y=request.goal.positions, goal_yd=request.goal.velocities
        )
        learned.execution_time_ = request.duration
        learned.dt_ = request.duration / 1000
        _, positions = learned.open_loop(run_t=request.duration)
        velocities = np.gradient(positions[:, 0], request.duration / (len(positions) - 1), edge_order=2)
        return np.gradient(velocities, request.duration / (len(positions) - 1), edge_order=2)

    return solve
