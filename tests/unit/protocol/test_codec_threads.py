"""Decoding in several threads at once."""

import subprocess
import sys

DECODE = """
import sys, threading
from protocol.codec import decode, encode
from tests.golden.examples import EXAMPLES

sys.setswitchinterval(1e-7)
bodies = [(encode(message), type(message)) for message in EXAMPLES.values()]
together = threading.Barrier(4)

def decode_all():
    together.wait()
    for body, kind in bodies:
        decode(body, kind, 1 << 24)

threads = [threading.Thread(target=decode_all) for _ in range(4)]
for thread in threads:
    thread.start()
for thread in threads:
    thread.join()
"""


def test_several_threads_can_decode_the_first_messages_of_a_process() -> None:
    """Without a lock msgspec crashes with a segmentation fault."""
    done = subprocess.run([sys.executable, "-c", DECODE], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
