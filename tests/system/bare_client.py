"""A client in a foreign land: eclipse-zenoh and msgpack, nothing of the project.

    python bare_client.py ENDPOINT

learns a primitive from 200 samples, plans, executes, follows the status, cancels, reads the results. It prints one
JSON object of what it saw. Time is stepped, so it also turns the clock.
"""

import json
import math
import sys

import msgpack
import zenoh


class Arm:
    """Requests to one robot."""

    def __init__(self, endpoint: str) -> None:
        config = zenoh.Config()
        config.insert_json5("mode", '"client"')
        config.insert_json5("connect/endpoints", json.dumps([endpoint]))
        config.insert_json5("scouting/multicast/enabled", "false")
        self.session = zenoh.open(config)

    def ask(self, key: str, **request: object) -> dict:
        """Return the reply to `request`, or the body of the refusal under "refused"."""
        for reply in self.session.get(f"volley/arm/{key}", payload=msgpack.packb(request), timeout=20.0):
            if reply.ok is not None:
                return msgpack.unpackb(reply.ok.payload.to_bytes())
            return {"refused": msgpack.unpackb(reply.err.payload.to_bytes())}
        raise TimeoutError(f"nobody answers {key}")


def swing(joints: int, home: list[float]) -> list[list[float]]:
    """200 samples of a swing of the first joint from rest, the others still."""
    samples = []
    for k in range(200):
        s = k / 199
        first = home[0] - 0.4 * math.sin(math.pi * s) ** 3 + 0.6 * s**4
        samples.append([first, *home[1:joints]])
    return samples


def main(endpoint: str) -> dict:
    """Do all of it and return what was seen."""
    arm = Arm(endpoint)
    statuses = []
    subscriber = arm.session.declare_subscriber(
        "volley/arm/status", lambda sample: statuses.append(msgpack.unpackb(sample.payload.to_bytes())["mode"])
    )
    description = arm.ask("description")
    joints, home = len(description["joint_names"]), description["home"]
    samples = swing(joints, home)
    learned = arm.ask("learn", name="swing", positions=samples, rate=200.0)
    names = [entry["name"] for entry in arm.ask("primitives")["primitives"]]
    goal = {"primitive": "swing", "positions": samples[-1], "velocities": [1.5] + [0.0] * (joints - 1)}
    planned = arm.ask("goal", **goal, plan_only=True, include_trajectory=True)
    before = arm.ask("state")["positions"]
    played = arm.ask("goal", **goal, goal_id="first")
    arm.ask("sim/step", ticks=math.ceil(1000 * played["total_duration"]) + 40)
    first = arm.ask("result", goal_id="first")
    home_goal = {"primitive": "swing", "positions": home, "duration": 2.0, "goal_id": "second"}
    arm.ask("goal", **home_goal)
    arm.ask("sim/step", ticks=500)
    canceled = arm.ask("cancel", goal_id="second")
    arm.ask("sim/step", ticks=600)
    second = arm.ask("result", goal_id="second")
    final = arm.ask("status")
    refused = arm.ask("goal", primitive="swing", positions=[9.0] + home[1:])
    forgotten = arm.ask("forget", name="swing")
    subscriber.undeclare()
    arm.session.close()
    return {
        "learned": learned,
        "names": names,
        "planned_samples": len(planned["trajectory"]["positions"]) // (8 * joints),
        "planned_certified": planned["report"]["certified"],
        "stood_still": before == arm_home(before, home),
        "first": first,
        "canceled": canceled,
        "second": second,
        "final": final,
        "refused": refused,
        "forgotten": forgotten,
        "modes": sorted(set(statuses)),
    }


def arm_home(positions: list[float], home: list[float]) -> list[float]:
    """Return `positions` where they are home to 10⁻⁶ rad, otherwise home."""
    return positions if all(abs(p - h) < 1e-6 for p, h in zip(positions, home, strict=True)) else home


if __name__ == "__main__":
    print(json.dumps(main(sys.argv[1])))
