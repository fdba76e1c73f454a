"""Plan a motion without a robot, a bus or a process: `motion` alone, arrays in and arrays out.

    python examples/plan_offline.py

A demonstration of two joints is learned, then planned to another goal, in less time, under limits. The plan keeps the
limits at all times and ends in a stop; its report says which limits shaped it. A goal that cannot be met is refused
with a duration that works.
"""

import numpy as np

from motion.demonstration import Demonstration
from motion.errors import Infeasible
from motion.limits import Limits
from motion.plan import plan
from motion.primitive import learn
from motion.request import Boundary, MotionRequest

FREE = np.full(2, np.nan)


def swing() -> Demonstration:
    """A swing of two joints that begins at rest and ends in motion: 200 samples a second for one second."""
    times = np.arange(201) / 200
    away = np.sin(np.pi * times) ** 3
    return Demonstration(times, np.stack([0.8 * times**3 - 0.4 * away, 0.3 * away - 0.2 * times**4], axis=1))


def request(duration: float) -> MotionRequest:
    """A hit at a given velocity, under limits of 2 rad, 2.6 rad/s, 30 rad/s² and 2000 rad/s³."""
    return MotionRequest(
        start=Boundary(np.zeros(2), np.zeros(2), np.zeros(2)),
        goal=Boundary(np.array([0.9, -0.1]), np.array([2.5, -0.5]), FREE),
        duration=duration,
        limits=Limits(np.array([[-2.0, 2.0]] * 2), np.full(2, 2.6), np.full(2, 30.0), np.full(2, 2000.0)),
    )


def main() -> None:
    """Learn, plan, print."""
    primitive = learn(swing())
    planned = plan(primitive, request(0.8))
    samples = planned.samples()
    print(f"{len(samples)} samples: the hit after {planned.duration} s, at rest after {planned.total_duration} s")
    print("ends at", samples.positions[planned.hit_index].round(6), "rad")
    print("moving at", samples.velocities[planned.hit_index].round(6), "rad/s")
    for active in planned.report.active:
        print(f"shaped by the limit on the {active.quantity} of joint {active.joint}")  # counted from 0
    try:
        plan(primitive, request(0.1))
    except Infeasible as error:
        print(f"refused: {error}")


if __name__ == "__main__":
    main()
