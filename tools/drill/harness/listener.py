"""`python -m tools.drill.harness.listener ENDPOINT ROBOT`: hear everything; a line is printed once this one listens."""

import signal
import sys

from protocol import topics
from protocol.bus.bus import Bus
from protocol.bus.sessions import open_session

if __name__ == "__main__":
    with Bus(open_session([sys.argv[1]]), sys.argv[2]) as bus:
        heard = [bus.collect(topic, length=1) for topic in topics.PUBLICATIONS]
        print("listens", flush=True)
        signal.pause()
