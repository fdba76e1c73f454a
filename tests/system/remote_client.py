"""A client on another host: it reads one JSON line `[topic, fields]` and writes the reply, or null if there is none.

`alive/SERVICE` asks whether a service is alive; `hold/CLIENT_ID` declares the token of a client and keeps it.
"""

import json
import sys
from pathlib import Path

import msgspec

from protocol import topics
from protocol.bus.bus import Bus
from protocol.bus.sessions import open_session
from protocol.errors import NoAnswer, Refusal


def answer(bus: Bus, key: str, fields: dict) -> object:
    """Send the request and return the reply in a form that JSON can represent."""
    verb, _, name = key.partition("/")
    if verb == "alive":
        return bus.is_alive(name)
    if verb == "hold":
        bus.announce(f"client/{name}")
        return None
    topic = next(topic for topic in topics.QUERIES if topic.key == key)
    try:
        return msgspec.to_builtins(bus.ask(topic, topic.request(**fields)))
    except (NoAnswer, Refusal) as error:
        print(error, file=sys.stderr)
        return None


if __name__ == "__main__":
    with Bus(open_session(config_file=Path(sys.argv[1]))) as bus:
        for line in sys.stdin:
            print(json.dumps(answer(bus, *json.loads(line))), flush=True)
