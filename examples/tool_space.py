"""Send goals for the tool instead of the joints: its position, direction and velocity; also in waypoints.

    volley up                                 # in another shell
    python examples/tool_space.py [ENDPOINT]

The planner finds the postures for the tool's pose and plays the one that imitates the demonstration best. The tool is
the site that the robot's TOML names; its position and direction are in the world frame.
"""

import sys

from client import Refusal, connect, tool
from client import messages as m

PLACE = [0.2, -0.9, 1.2]
"""Position of the tool, m: a little above the demonstrated hit."""
ALONG = [1.0, 0.2, 0.1]
"""Direction of the racket's face."""
VELOCITY = [3.0, 0.5, 0.5]
"""Velocity of the racket at the hit, m/s."""
BEHIND = [-0.8, -0.5, 1.0]
"""A position that the racket passes as it swings back, m."""
TOO_FAR = [2.0, 0.0, 0.5]


def main(endpoint: str | None = None) -> None:
    """Strike at a place, move there through another place, and send a goal out of reach."""
    with connect(endpoint) as arm:
        hit = arm.goal("forehand", tool=tool(PLACE, axis=ALONG, velocity=VELOCITY))
        print("the joints end at", [round(value, 3) for value in hit.reply.positions], "rad")
        print("played:", hit.wait().outcome)
        behind = m.Waypoint(time_from_start=0.5, tool=tool(BEHIND))
        print("through a place behind it:", arm.goal("forehand", tool=tool(PLACE), waypoints=[behind]).wait().outcome)
        try:
            arm.goal("forehand", tool=tool(TOO_FAR))
        except Refusal as refusal:
            print(f"refused, {refusal.code}: {refusal}")
            nearest = refusal.detail["nearest"]["position"]
            print(f"{refusal.detail['distance']:.2f} m nearer it can be:", [round(value, 3) for value in nearest])


if __name__ == "__main__":
    main(*sys.argv[1:])
