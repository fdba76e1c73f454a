"""Lead the demonstrated movement through a place on the way, with one joint there and the others free.

    volley up                                 # in another shell
    python examples/waypoints.py [ENDPOINT]

The waypoint is met exactly, and the rest of the motion imitates the demonstration as well as that allows. The plan
comes back as arrays, so that this can be seen.
"""

import sys

import numpy as np

from client import connect, samples
from client import messages as m

FREE = None
AT = 0.4
"""When, s after the start."""
PLACE = [-0.8, FREE, FREE, FREE, FREE, FREE]
"""Where the first joint then is, rad."""


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
