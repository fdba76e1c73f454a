"""Strike: play the demonstrated forehand faster and sooner, and see how exactly the arm met the hit.

    volley up                              # in another shell
    python examples/strike.py [ENDPOINT]

A goal that cannot be met moves nothing: it is refused with a code, a sentence, and what the sentence is about.
"""

import sys

from client import Refusal, connect

HIT = [0.17, 0.47, 0.86, -0.0822, 0.0, 0.1058]
"""Where the joints are at the hit, rad: where the demonstration ends, and the ball is."""
VELOCITIES = [5.5, -0.4, -0.3, -0.8, -0.4, 1.2]
"""And how fast they move, rad/s: the first joint faster than demonstrated."""


def main(endpoint: str | None = None) -> None:
    """Strike, and ask for too much."""
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
