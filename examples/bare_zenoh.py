"""A client without Volley: eclipse-zenoh and msgpack alone. Copy it into any project.

    volley up                                  # in another shell
    python examples/bare_zenoh.py [ENDPOINT]

A request is a Zenoh query whose payload is a msgpack map. The answer is one reply, or an error with a code and a
sentence. docs/protocol.md lists every key and field.
"""

import json
import sys
import time

import msgpack
import zenoh

PREFIX = "volley/arm/"


def ask(session: zenoh.Session, key: str, **request: object) -> dict:
    """Send a request and return its reply."""
    for reply in session.get(PREFIX + key, payload=msgpack.packb(request), timeout=15.0):
        if reply.ok:
            return msgpack.unpackb(reply.ok.payload.to_bytes())
        if reply.err:
            error = msgpack.unpackb(reply.err.payload.to_bytes())
            raise RuntimeError(f"{error['code']}: {error['message']}")
    raise TimeoutError(f"nobody answers {PREFIX}{key}; start the robot")


def main(endpoint: str = "tcp/127.0.0.1:7447") -> None:
    """Play the forehand; print its result and the contacts that were published meanwhile."""
    config = zenoh.Config()
    config.insert_json5("mode", '"client"')
    config.insert_json5("connect/endpoints", json.dumps([endpoint]))
    with zenoh.open(config) as session:
        touched = []
        session.declare_subscriber(
            PREFIX + "contact", lambda sample: touched.append(msgpack.unpackb(sample.payload.to_bytes()))
        )
        goal = ask(session, "goal", primitive="forehand")
        print(f"goal {goal['goal_id']} hits {goal['duration']:.3f} s after its start")
        while (result := ask(session, "result", goal_id=goal["goal_id"]))["outcome"] == "running":
            time.sleep(0.05)
        print(result["outcome"], result["hit"])
        for contact in touched:
            print(" touches ".join(contact["bodies"]), f"with {contact['impulse']:.3f} N·s")


if __name__ == "__main__":
    main(*sys.argv[1:])
