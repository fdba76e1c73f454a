"""Return one ball: throw it, let the striker play, and print what it decides.

Start the services with the striker first, in another terminal: `python -m services --strike`

    python examples/rally.py
"""

import sys

from client import connect, topics

TARGET = (4.5, 0.0, 0.0)
THROWN_FROM, THROWN_WITH = (5.16, -0.09, 1.34), (-6.32, -0.49, 0.79)
PATIENCE_S = 20.0


def main(endpoint: str | None = None) -> None:
    """Throw a ball and print each decision until it has landed or was missed."""
    with connect(endpoint) as arm, arm.stream(topics.STRIKES) as decisions:
        arm.strike(TARGET, count=1)
        arm.throw(THROWN_FROM, THROWN_WITH)
        while True:
            strike = decisions.take(PATIENCE_S)
            if strike.phase == "revised":
                continue
            landed = f", {strike.landing.distance:.2f} m from the target" if strike.landing else ""
            print(f"{strike.time:.2f} s: ball {strike.ball} {strike.phase}{landed} {strike.reason}")
            if strike.phase in ("landed", "missed"):
                print(f"{strike.revisions} corrections")
                return


if __name__ == "__main__":
    main(*sys.argv[1:2])
