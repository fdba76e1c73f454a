"""Play the demonstrated forehand with a faster and earlier hit, and print the arm's error at the hit.

    volley up                              # in another shell
    python examples/strike.py [ENDPOINT]

A goal that cannot be met moves nothing: it is refused with a code, a sentence, and a detail with the values.
"""

import sys

from client import Refusal, connect

HIT = [0.17, 0.47, 0.86, -0.0822, 0.0, 0.1058]
"""Positions of the joints at the hit, rad: the end of the demonstration, at the ball."""
VELOCITIES = [5.5, -0.4, -0.3, -0.8, -0.4, 1.2]
"""Velocities of the joints at the hit, rad/s; the first joint is faster than demonstrated."""


def main(endpoint: str | None = None) -> None:
    """Strike, then send a goal outside the joint limits."""
    with connect(endpoint) as arm:
        goal = arm.goal("forehand", positions=HIT, velocities=VELOCITIES, duration=0.9)
        report = goal.reply.report
        print(f"planned in {report.solve_ms:.1f} ms; inside all limits at all times: {report.certified}")
        result = goal.wait()
        print(result.outcome, result.reason)
        if result.hit:
            print(f"at the hit the arm was {max(map(abs, result.hit.position_error)):.1e} rad off,")
            print(f"and {max(map(abs, result.hit.velocity_error)):.1e} rad/s")
        try:
            arm.goal("forehand", positions=[9.0, *HIT[1:]])
        except Refusal as refusal:
            print(f"refused, {refusal.code}: {refusal}")
            print(f"the bound on the {refusal.detail['quantity']} is {refusal.detail['bound']:.3f} rad")


if __name__ == "__main__":
    main(*sys.argv[1:])
