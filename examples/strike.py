"""Strike: play the demonstrated forehand to another place, faster, and see how exactly the arm was there.

    volley up                              # in another shell
    python examples/strike.py [ENDPOINT]

A goal that cannot be met moves nothing: it is refused with a code, a sentence, and what the sentence is about.
"""

import sys

from client import Refusal, connect

HIT = [0.25, 0.5, 0.8, -0.1, 0.0, 0.1]
"""Where the joints are at the hit, rad."""
VELOCITIES = [5.0, -0.4, -0.3, -0.8, -0.4, 1.2]
"""And how fast they move, rad/s."""


def main(endpoint: str | None = None) -> None:
    """Strike, and ask for too much."""
    with connect(endpoint) as arm:
        goal = arm.goal("forehand", positions=HIT, velocities=VELOCITIES, duration=0.9)
        report = goal.reply.report
        print(f"planned in {report.solve_ms:.1f} ms; inside all limits at all times: {report.certified}")
        result = goal.wait()
        print(f"{result.outcome}: {result.reason}")
        if result.hit:
            print(f"at the hit the arm was {max(map(abs, result.hit.position_error)):.1e} rad off,")
            print(f"and {max(map(abs, result.hit.velocity_error)):.1e} rad/s")
        try:
            arm.goal("forehand", positions=HIT, velocities=VELOCITIES, duration=0.1)
        except Refusal as refusal:
            print(f"in 0.1 s it is refused, {refusal.code}: {refusal}")
            print(f"it takes {refusal.detail.get('min_duration', 0.0):.3f} s")


if __name__ == "__main__":
    main(*sys.argv[1:])
