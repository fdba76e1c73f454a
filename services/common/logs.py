"""Logs of the services: sentences for a terminal, or one JSON object a line for a machine.

A record about a goal or a refusal carries it in a field: `extra={"goal_id": …, "code": …}`.
"""

import json
import logging
import sys
import threading
import time
from types import TracebackType
from typing import Literal

LogForm = Literal["text", "json"]


class JsonFormatter(logging.Formatter):
    """Formats a record as one line of JSON.

    The fields are `time` (RFC 3339 in UTC, to the millisecond), `service`, `level`, `message`, `goal_id`, `code` and
    `traceback`; the last three may be null.
    """

    converter = time.gmtime
    default_time_format = "%Y-%m-%dT%H:%M:%S"
    default_msec_format = "%s.%03dZ"

    def __init__(self, service: str) -> None:
        super().__init__()
        self._service = service

    def format(self, record: logging.LogRecord) -> str:
        """Return the line, without a newline; in ASCII, so that it does not depend on the locale."""
        return json.dumps(
            {
                "time": self.formatTime(record),
                "service": self._service,
                "level": record.levelname,
                "message": record.getMessage(),
                "goal_id": getattr(record, "goal_id", None),
                "code": getattr(record, "code", None),
                "traceback": self.formatException(record.exc_info) if record.exc_info else None,
            }
        )


def formatter(service: str, form: LogForm) -> logging.Formatter:
    """Return the formatter of `service`'s records: `time service level: sentence`, or JSON."""
    if form == "json":
        return JsonFormatter(service)
    return logging.Formatter(f"%(asctime)s {service} %(levelname)s: %(message)s")


def start_logging(service: str, form: LogForm) -> logging.Logger:
    """Log to stderr in `form`, including Python's warnings and uncaught errors; return the service's logger."""
    handler = logging.StreamHandler(sys.stderr)
    handler.setFormatter(formatter(service, form))
    logging.basicConfig(level=logging.INFO, handlers=[handler])
    logging.captureWarnings(True)
    log = logging.getLogger(service)
    _log_uncaught(log)
    return log


def _log_uncaught(log: logging.Logger) -> None:
    """Log uncaught exceptions of all threads, instead of printing tracebacks."""

    def uncaught(kind: type[BaseException], error: BaseException | None, trace: TracebackType | None) -> None:
        if error is not None and not isinstance(error, SystemExit):
            log.critical("uncaught %s: %s", kind.__name__, error, exc_info=(kind, error, trace))

    sys.excepthook = uncaught
    threading.excepthook = lambda args: uncaught(args.exc_type, args.exc_value, args.exc_traceback)


class ThrottledLog:
    """Logs a frequent warning at most once a second, with the count of all so far."""

    def __init__(self, log: logging.Logger) -> None:
        self._log = log
        self._count = 0
        self._next_ns = 0

    def warn(self, sentence: str, code: str | None = None) -> None:
        """Count the warning, and log `sentence` if the last one was logged over a second ago; `code`: of a refusal."""
        self._count += 1
        now_ns = time.monotonic_ns()
        if now_ns >= self._next_ns:
            self._next_ns = now_ns + 1_000_000_000
            self._log.warning("%s (%d so far)", sentence, self._count, extra={"code": code})
