"""The signals that end a process."""

import signal
import threading

from services.common.lifeline import follow_supervisor


def stop_on_signals() -> threading.Event:
    """Return an event that SIGTERM, SIGINT and the end of the supervisor set, instead of killing the process.

    A separate thread waits for the signals, and this one blocks them: in Python 3.11 a signal that interrupts
    `SimpleQueue.get` near the end of its timeout leaves it waiting for ever. Threads that a library made before this
    call do not block them. The handlers keep a signal that reaches one of those from killing the process, and set the
    event when this thread next runs: wait for the event with a short timeout, in a loop.
    """
    stopping = threading.Event()
    numbers = {signal.SIGTERM, signal.SIGINT}
    for number in numbers:
        signal.signal(number, lambda *_: stopping.set())
    signal.pthread_sigmask(signal.SIG_BLOCK, numbers)

    def wait() -> None:
        signal.sigwait(numbers)
        stopping.set()

    threading.Thread(target=wait, name="signals", daemon=True).start()
    follow_supervisor(stopping)
    return stopping


def end_like_ctrl_c() -> None:
    """Make the first SIGTERM raise KeyboardInterrupt, so that context managers clean up.

    Later ones are ignored, because they would interrupt the clean-up and leave processes behind. `timeout` sends two.
    """

    def interrupt(*_: object) -> None:
        signal.signal(signal.SIGTERM, signal.SIG_IGN)
        raise KeyboardInterrupt

    signal.signal(signal.SIGTERM, interrupt)
