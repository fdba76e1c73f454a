"""Check whether a motion can keep its limits in a duration, with what the checks of other durations found."""

from dataclasses import dataclass, field

import numpy as np

from motion.errors import LimitExceeded, SolverFailed
from motion.primitive import Primitive
from motion.program.constraint_generation import NO_ROWS, refutes
from motion.program.contradiction import InfeasibleRows
from motion.program.effort import CHECK, Effort
from motion.program.equalities import fixed_inside
from motion.program.optimum import feasible
from motion.program.problem import LEAST_ACCELERATION, MANY_FUNCTIONS, USUAL, Precision, Problem, build
from motion.request import MotionRequest


@dataclass(slots=True, eq=False)
class FeasibilityCheck:
    """Checks of one motion in several durations.

    final: as returned by `arriving`. effort: of all checks together. order: the joints, those that failed last first.
    active: of each joint, the rows with a multiplier in the last feasible duration. contradictions: rows that
    contradicted each other in the last infeasible duration, by joint.
    """

    primitive: Primitive
    final: np.ndarray
    effort: Effort
    precision: Precision = USUAL
    order: list[int] = field(init=False)
    active: list[np.ndarray] = field(init=False)
    contradictions: dict[int, InfeasibleRows] = field(init=False, default_factory=dict)

    def __post_init__(self) -> None:
        self.order = list(range(self.primitive.joint_count))
        self.active = [NO_ROWS] * self.primitive.joint_count
        if self.primitive.basis_count <= MANY_FUNCTIONS:
            self.precision = LEAST_ACCELERATION

    def passes(self, request: MotionRequest, most: float) -> bool:
        """Return whether all joints can be planned in a duration; each may take an effort of `most`.

        The joint that failed last is tried first and alone. Raises OutOfTime if `effort` is spent.
        """
        failing = self._failing(request, most)
        if failing is not None:
            self.order.remove(failing)
            self.order.insert(0, failing)
        return failing is None

    def _failing(self, request: MotionRequest, most: float) -> int | None:
        try:
            problem = self._problem(request)
        except (LimitExceeded, InfeasibleRows) as failure:
            return failure.joint
        for group in filter(None, (self.order[:1], self.order[1:])):
            self.effort.spend(group[0], CHECK * len(group))
            try:
                with self.effort.share(most * len(group)) as share:
                    found = feasible(problem, group, share, self.active)
            except SolverFailed as failure:
                return failure.joint
            except InfeasibleRows as failure:
                self.contradictions[failure.joint] = failure
                return failure.joint
            for joint in group:
                self.active[joint] = found[joint]
        return None

    def _problem(self, request: MotionRequest) -> Problem:
        """The problem in a duration. Raises LimitExceeded or InfeasibleRows."""
        request, fixed = fixed_inside(request)
        problem = build(self.primitive, request, fixed, self.final, self.precision)
        for found in self.contradictions.values():
            if refutes(problem, found.rows, found.multipliers):
                raise found
        return problem
