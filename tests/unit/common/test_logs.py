"""The log of a service, as text and as JSON."""

import json
import logging
import subprocess
import sys
import time
from collections.abc import Iterator
from typing import Any

import pytest

from services.common.logs import LogForm, ThrottledLog, formatter

FIELDS = ["time", "service", "level", "message", "goal_id", "code", "traceback"]


@pytest.fixture(autouse=True)
def abroad() -> Iterator[None]:
    """Make local time two hours ahead of UTC."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("TZ", "UTC-2")
        time.tzset()
        yield
    time.tzset()


def record(sentence: str, *args: object, exc_info: Any = None, **fields: object) -> logging.LogRecord:
    """Return a warning at 0.0625 s past 2001-09-09 01:46:40 UTC, with `fields` set as by `extra`."""
    made = logging.LogRecord("planner", logging.WARNING, "core.py", 1, sentence, args, exc_info)
    made.created, made.msecs = 1_000_000_000.0625, 62.0
    for name, value in fields.items():
        setattr(made, name, value)
    return made


def logged(*args: Any, **fields: Any) -> dict[str, Any]:
    """Return the JSON object of a record."""
    line = formatter("planner", "json").format(record(*args, **fields))
    assert "\n" not in line
    assert line.isascii()
    return json.loads(line)


def failure() -> BaseException:
    """Return an error that was raised here."""
    try:
        raise ValueError("out of oil")
    except ValueError as error:
        return error


@pytest.mark.parametrize("fields", [{}, {"goal_id": "g-1", "code": "late"}])
def test_a_text_line_has_only_time_and_sentence(fields: dict[str, object]):
    """The line has the local time and the sentence, but no fields."""
    line = formatter("planner", "text").format(record("goal %s: too late", "g-1", **fields))
    assert line == "2001-09-09 03:46:40,062 planner WARNING: goal g-1: too late"


def test_text_ends_with_the_traceback():
    error = failure()
    text = formatter("sim", "text").format(record("broken", exc_info=(ValueError, error, error.__traceback__)))
    assert "WARNING: broken\nTraceback" in text
    assert text.endswith("ValueError: out of oil")


def test_a_json_object_has_every_field():
    """The time is RFC 3339 in UTC; goal id and code are fields beside the sentence."""
    said = logged("goal %s: too late", "g-1", goal_id="g-1", code="late")
    assert list(said) == FIELDS
    assert said == {
        "time": "2001-09-09T01:46:40.062Z",
        "service": "planner",
        "level": "WARNING",
        "message": "goal g-1: too late",
        "goal_id": "g-1",
        "code": "late",
        "traceback": None,
    }


def test_missing_fields_are_null():
    said = logged("the arm is there")
    assert list(said) == FIELDS
    assert [said[name] for name in ("goal_id", "code", "traceback")] == [None, None, None]


def test_a_json_object_is_a_single_line():
    """Sentences may quote what a client sent, line breaks included."""
    strange = 'two\nlines, "quotes", µ and \ud800'
    assert logged("goal %s", strange, goal_id=strange)["goal_id"] == strange


def test_the_traceback_is_a_field():
    error = failure()
    said = logged("broken", exc_info=(ValueError, error, error.__traceback__))
    assert said["message"] == "broken"
    assert said["traceback"].startswith("Traceback")
    assert said["traceback"].endswith("ValueError: out of oil")


LOGGING = """
import sys, threading, warnings
from services.common.logs import start_logging
start_logging("sim", sys.argv[1]).info("one", extra={"goal_id": "g-1"})
warnings.warn("two")
thread = threading.Thread(target=lambda: 1 / 0)
thread.start()
thread.join()
{}["four"]
"""


def output_of(form: LogForm) -> str:
    """Return what a process prints that logs, warns, and raises in a thread and at its end."""
    done = subprocess.run([sys.executable, "-c", LOGGING, form], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (1, "")
    return done.stderr


def test_all_output_of_a_process_is_json():
    """Python's warnings and uncaught errors are JSON lines too."""
    said = [json.loads(line) for line in output_of("json").splitlines()]
    assert [each["level"] for each in said] == ["INFO", "WARNING", "CRITICAL", "CRITICAL"]
    assert [each["service"] for each in said] == ["sim"] * 4
    assert (said[0]["message"], said[0]["goal_id"]) == ("one", "g-1")
    assert "UserWarning: two" in said[1]["message"]
    assert said[2]["message"] == "uncaught ZeroDivisionError: division by zero"
    assert said[3]["message"] == "uncaught KeyError: 'four'"
    assert all("Traceback" in each["traceback"] for each in said[2:])


def test_text_output_has_the_same_messages():
    said = output_of("text")
    assert " sim INFO: one\n" in said
    assert " sim CRITICAL: uncaught KeyError: 'four'\nTraceback" in said


def test_a_warning_at_every_tick_is_throttled(caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch):
    """The first warning is logged at once; the next, a second later, has the number of those in between."""
    now_ns = [5]
    monkeypatch.setattr(time, "monotonic_ns", lambda: now_ns[0])
    seldom = ThrottledLog(logging.getLogger("sim"))
    for _ in range(5):
        seldom.warn("a command was refused", "bad_message")
    assert caplog.messages == ["a command was refused (1 so far)"]
    now_ns[0] += 999_999_999
    seldom.warn("a command was refused", "bad_message")
    assert len(caplog.messages) == 1
    now_ns[0] += 1
    seldom.warn("a command was refused", "bad_message")
    assert caplog.messages[1:] == ["a command was refused (7 so far)"]
    assert [getattr(each, "code", None) for each in caplog.records] == ["bad_message"] * 2
