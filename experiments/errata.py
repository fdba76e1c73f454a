"""The paper's three slips, and the error of each if taken literally."""

import numpy as np

from experiments.common import (
    DEMONSTRATED_START,
    STEP,
    Outcome,
    Row,
    ask,
    figure_primitive,
    gaussian,
    rms,
    state,
)
from motion.gaussian import BASIS_COUNT
from motion.gaussian_basis import make_basis
from motion.gaussian_program import make_programs
from motion.primitive import Primitive
from motion.request import MotionRequest

DURATION = 0.8


def run() -> Outcome:
    """Solve eq. 16 in physical time by its KKT system: corrected, and with each slip."""
    primitive = figure_primitive()
    request = ask(DEMONSTRATED_START, state(1.0, 3.0 / DURATION), DURATION)
    right = accelerations(primitive, request)
    _, planned = gaussian(primitive, request)
    slips = {
        "tau_inverted": accelerations(primitive, request, tau=DURATION),
        "theta_kept": accelerations(primitive, request, kept=True),
        "linear_term": accelerations(primitive, request, factor=-1.0),
    }
    claims = {
        "tau_inverted": "tau is the time scale due to different durations (eq. 10)",
        "theta_kept": "theta remains unchanged while Psi is recomputed (after eq. 16)",
        "linear_term": "the linear term is +tau² thetaᵀw (eq. 16)",
    }
    rows = [
        Row("errata.right_against_gaussian", rms(right - planned[2]) / rms(right), "of the rms"),
        *(
            Row(f"errata.{name}", rms(wrong - right) / rms(right), "of the rms", claims[name])
            for name, wrong in slips.items()
        ),
    ]
    return Outcome(rows)


def accelerations(
    primitive: Primitive, request: MotionRequest, tau: float | None = None, kept: bool = False, factor: float = 2.0
) -> np.ndarray:
    """Return g̈ (n,) of min wᵀΨw − factor·τ²θᵀw in physical time under eq. 14; correct are factor 2 and τ = T_d/T.

    `kept`: use θ of the demonstration's duration although Ψ is of the request's.
    """
    basis, duration = make_basis(BASIS_COUNT), request.duration
    tau = primitive.duration / duration if tau is None else tau
    # ∫ψ_i d̈ dt. The program's linear term is −2θ, where θ is the integral of T_d²·d̈ over s.
    theta = -make_programs(primitive, request, BASIS_COUNT)[0].c / 2 / primitive.duration**2
    theta = theta * (primitive.duration if kept else duration)
    end = np.array([1.0])
    rows = np.concatenate([basis.rows(end, -2) * duration**2, basis.rows(end, -1) * duration])
    start, goal = request.start, request.goal
    travel = (goal.positions - start.positions - duration * start.velocities)[0]
    targets = np.array([travel, (goal.velocities - start.velocities)[0]])
    kkt = np.block([[2 * basis.gram() * duration, rows.T], [rows, np.zeros((2, 2))]])
    weights = np.linalg.solve(kkt, np.concatenate([factor * tau**2 * theta, targets]))[:BASIS_COUNT]
    return basis.rows(np.linspace(0, 1, round(duration / STEP) + 1), 0) @ weights
