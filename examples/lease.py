"""Hold the arm: while one client has a lease, others are refused, and what moves is stopped when it ends.

    volley up                             # in another shell
    python examples/lease.py [ENDPOINT]

A lease is what a program wants whose death must stop the arm: the controller sees that its session is gone, within 2 s
where its machine was cut off and at once where it ended.
"""

import sys
import time

from client import Refusal, connect

FAR = [0.5, 0.5, 0.8, 0.0, 0.0, 0.1]


def main(endpoint: str | None = None) -> None:
    """Two clients, one arm."""
    with connect(endpoint, client_id="alice") as alice, connect(endpoint, client_id="bob") as bob:
        with alice.lease():
            goal = alice.goal("forehand", positions=FAR, duration=4.0)
            print("alice moves the arm")
            try:
                bob.goal("forehand")
            except Refusal as refusal:
                print(f"bob is refused, {refusal.code}: {refusal}")
        print(f"alice's lease ends before her motion: {goal.wait().outcome}")
        while bob.status().mode != "holding":
            time.sleep(0.01)  # the stop takes a moment
        print(f"now bob's goal is taken: {bob.goal('forehand').wait().outcome}")


if __name__ == "__main__":
    main(*sys.argv[1:])
