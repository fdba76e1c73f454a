"""Correct a goal in motion: while the arm swings, new estimates of the target arrive.

    volley up                               # in another shell
    python examples/correct.py [ENDPOINT]

A correction imitates the rest of the demonstration, from the phase that the motion has reached; the hit keeps its time.
A correction is a new goal, and the corrected goal ends as `preempted`.
"""

import sys
import time

from client import Arm, connect

ESTIMATES = [0.05, 0.09, 0.11]
"""Successive estimates of the first joint's position at the hit, rad; all short of the ball, which would push it."""
REST = [0.47, 0.86, -0.08, 0.0, 0.1]


def wait_until(arm: Arm, moment: float) -> None:
    """Return at a moment of the robot's clock."""
    while arm.status().time < moment:
        time.sleep(0.01)


def main(endpoint: str | None = None) -> None:
    """Swing, and correct the swing twice."""
    with connect(endpoint) as arm:
        goal = first = arm.goal("forehand", positions=[ESTIMATES[0], *REST], duration=1.5)
        for k, estimate in enumerate(ESTIMATES[1:], 1):
            wait_until(arm, first.start_time + 0.3 * k)
            goal = goal.correct(positions=[estimate, *REST])
            hit = goal.start_time + goal.reply.duration
            print(f"corrected at phase {goal.reply.report.phase:.2f}: hits at {estimate} rad, {hit:.3f} s")
        result = goal.wait()
        print(f"the first goal was {first.wait().outcome}, the last one {result.outcome}")
        if result.hit:
            print(f"off by {max(map(abs, result.hit.position_error)):.1e} rad at {result.hit.time:.3f} s")


if __name__ == "__main__":
    main(*sys.argv[1:])
