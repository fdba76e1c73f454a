"""Use a lease: while one client has it, goals of others are refused, and the arm stops when the lease ends.

    volley up                             # in another shell
    python examples/lease.py [ENDPOINT]

Use a lease in a program whose death must stop the arm. The controller notices at once that the program has ended, and
within 2 s that its machine is unreachable.
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
