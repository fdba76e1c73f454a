"""Signals that end a process."""

import signal
import subprocess
import sys

import pytest

from services.common.signals import end_like_ctrl_c

WAITING = """
import signal, sys
from protocol.bus.queues import Stream
from services.common.signals import stop_on_signals
stopping, stream = stop_on_signals(), Stream()
blocked = signal.pthread_sigmask(signal.SIG_BLOCK, ())
print("ready", {signal.SIGTERM, signal.SIGINT} <= blocked, flush=True)
while not stopping.is_set():
    stream.take(0.0002)
print("stopped in order", flush=True)
"""


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_a_signal_stops_the_loop_in_order(number: signal.Signals):
    """A signal never interrupts a wait: in Python 3.11 that can leave a queue's `get` waiting for ever."""
    for _ in range(5):
        process = subprocess.Popen([sys.executable, "-c", WAITING], stdout=subprocess.PIPE, text=True)
        assert process.stdout is not None
        assert process.stdout.readline() == "ready True\n"
        process.send_signal(number)
        said, _ = process.communicate()
        assert (said, process.returncode) == ("stopped in order\n", 0)


def test_a_thread_that_was_there_before_does_not_let_a_signal_kill():
    """Rerun starts threads on import, before the service installs its signal handling."""
    script = (
        "import threading, time\n"
        "threading.Thread(target=time.sleep, args=(30,), daemon=True).start()\n"
        "from services.common.signals import stop_on_signals\n"
        "stopping = stop_on_signals()\n"
        "print('ready', flush=True)\n"
        "end = time.monotonic() + 20\n"
        "while not stopping.wait(0.1) and time.monotonic() < end: pass\n"
        "raise SystemExit(not stopping.is_set())\n"
    )
    process = subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, text=True)
    with process:
        assert process.stdout is not None
        assert process.stdout.readline() == "ready\n"
        process.terminate()
        assert process.wait(20) == 0


def test_a_second_sigterm_does_not_interrupt_the_ending():
    """`timeout` sends two signals: one to the process and one to its group."""
    before = signal.getsignal(signal.SIGTERM)
    try:
        end_like_ctrl_c()
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGTERM)
        signal.raise_signal(signal.SIGTERM)
    finally:
        signal.signal(signal.SIGTERM, before)
