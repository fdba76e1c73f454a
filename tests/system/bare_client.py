"""A client that imports nothing of Volley, only eclipse-zenoh and msgpack. Copy from it.

    python bare_client.py ENDPOINT

It learns a swing from 200 samples, plans it, plays it, follows the status, cancels a second motion, asks for both
results, and forgets the swing. It prints what it observed as one JSON object. The arm's clock is stepped here, so the
client also advances the time; on an arm in real time it would wait.
"""

import json
import math
import sys
from collections.abc import Callable

import msgpack
import zenoh


class Refused(Exception):
    """A service refused a request: the code, a sentence, and its detail."""

    def __init__(self, code: str, message: str, detail: dict) -> None:
        super().__init__(message)
        self.code, self.message, self.detail = code, message, detail


class Arm:
    """One robot on the bus."""

    def __init__(self, endpoint: str, robot: str = "arm") -> None:
        config = zenoh.Config()
        config.insert_json5("mode", '"client"')
        config.insert_json5("connect/endpoints", json.dumps([endpoint]))
        config.insert_json5("scouting/multicast/enabled", "false")
        self.session = zenoh.open(config)
        self.prefix = f"volley/{robot}/"

    def ask(self, key: str, **request: object) -> dict:
        """Send a request and return the reply."""
        for reply in self.session.get(self.prefix + key, payload=msgpack.packb(request), timeout=60.0):
            if reply.ok:
                return msgpack.unpackb(reply.ok.payload.to_bytes())
            assert reply.err
            raise Refused(**msgpack.unpackb(reply.err.payload.to_bytes()))
        raise TimeoutError(f"nobody answers {self.prefix}{key}")

    def follow(self, key: str, callback: Callable[[dict], object]) -> zenoh.Subscriber:
        """Call `callback` with every message published on `key`."""
        return self.session.declare_subscriber(
            self.prefix + key, lambda sample: callback(msgpack.unpackb(sample.payload.to_bytes()))
        )

    def let_pass(self, seconds: float) -> None:
        """Let time pass on the stepped clock."""
        self.ask("sim/step", ticks=math.ceil(seconds * 1000))


def swing(home: list[float]) -> list[list[float]]:
    """Return 200 samples of the first joint: forward from home, then back past it with growing speed."""
    path = [0.1 * math.sin(math.pi * k / 199) ** 3 - 0.6 * (k / 199) ** 4 for k in range(200)]
    return [[home[0] + x, *home[1:]] for x in path]


def main(endpoint: str) -> dict:
    """Make all requests and return what was observed."""
    arm = Arm(endpoint)
    modes = set()
    status = arm.follow("status", lambda message: modes.add(message["mode"]))
    home = arm.ask("description")["home"]
    seen: dict = {}

    samples = swing(home)
    seen["learned"] = arm.ask("learn", name="swing", positions=samples, rate=200.0)
    seen["library"] = [primitive["name"] for primitive in arm.ask("primitives")["primitives"]]

    goal = {"primitive": "swing", "positions": samples[-1], "velocities": [-1.5, 0, 0, 0, 0, 0]}
    seen["before"] = arm.ask("state")["positions"]
    planned = arm.ask("goal", **goal, plan_only=True, include_trajectory=True)
    arm.let_pass(0.1)
    seen["after_planning"] = arm.ask("state")["positions"]
    seen["certified"] = planned["report"]["certified"]
    seen["samples"] = len(planned["trajectory"]["positions"]) // (8 * len(home))
    seen["total_duration"] = planned["total_duration"]

    played = arm.ask("goal", **goal, goal_id="first")
    arm.let_pass(played["total_duration"] + 0.05)
    seen["first"] = arm.ask("result", goal_id="first")
    seen["at_goal"] = arm.ask("status")

    arm.ask("goal", primitive="swing", positions=home, duration=2.0, goal_id="second")
    arm.let_pass(0.5)
    seen["canceled"] = arm.ask("cancel", goal_id="second")
    arm.let_pass(0.5)
    seen["second"] = arm.ask("result", goal_id="second")
    seen["at_last"] = arm.ask("status")

    try:
        arm.ask("goal", primitive="swing", positions=[9.0, *home[1:]])
    except Refused as refused:
        seen["refused"] = {"code": refused.code, "message": refused.message, "detail": refused.detail}
    seen["forgotten"] = arm.ask("forget", name="swing")["name"]
    seen["left"] = [primitive["name"] for primitive in arm.ask("primitives")["primitives"]]
    status.undeclare()
    seen["modes"] = sorted(modes)
    arm.session.close()
    return seen


if __name__ == "__main__":
    print(json.dumps(main(sys.argv[1])))
