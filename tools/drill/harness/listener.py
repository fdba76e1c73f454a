"""`python -m tools.drill.harness.listener ENDPOINT ROBOT`: subscribe to all publications, print a line, wait."""

import signal
import sys

from protocol import topics
from protocol.bus.bus import Bus
from protocol.bus.sessions import open_session

if __name__ == "__main__":
    with Bus(open_session([sys.argv[1]]), sys.argv[2]) as bus:
        collectors = [bus.collect(topic, length=1) for topic in topics.PUBLICATIONS]
        print("subscribed", flush=True)
        signal.pause()
