"""Play the demonstrated movement through a waypoint that fixes one joint and leaves the others free.

    volley up                                 # in another shell
    python examples/waypoints.py [ENDPOINT]

The motion passes the waypoint exactly, and imitates the demonstration as closely as that allows. The program prints
values from the plans, which it receives as arrays.
"""

import sys

import numpy as np

from client import connect, samples
from client import messages as m

FREE = None
AT = 0.4
"""Time of the waypoint, s after the start."""
PLACE = [-0.8, FREE, FREE, FREE, FREE, FREE]
"""Positions at the waypoint, rad: only the first joint is fixed."""


def main(endpoint: str | None = None) -> None:
    """Plan without and with the waypoint, then play it."""
    waypoint = m.Waypoint(time_from_start=AT, positions=PLACE)
    with connect(endpoint) as arm:
        plain = arm.plan("forehand", include_trajectory=True)
        led = arm.plan("forehand", waypoints=[waypoint], include_trajectory=True)
        for name, plan in (("without", plain), ("with", led)):
            motion = samples(plan)
            there = np.searchsorted(motion.times, plan.start_time + AT - 1e-9)
            rms = max(plan.report.imitation_rms)
            print(f"{name} it: joint 1 at {motion.positions[there, 0]:.4f} rad; unlike by {rms:.2f} rad/s² rms")
        print(arm.goal("forehand", waypoints=[waypoint]).wait().outcome)


if __name__ == "__main__":
    main(*sys.argv[1:])
