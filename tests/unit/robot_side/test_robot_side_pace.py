"""Warnings about a machine that is too slow."""

import logging

import pytest

from services.common.robot_side import clocks
from services.common.robot_side.clocks import MEASURED_S, REPEAT_S, Pace


@pytest.mark.parametrize(("tick_s", "said"), [(0.001, []), (0.00104, []), (0.00125, ["0.80"]), (0.01, ["0.10"])])
def test_a_slow_machine_is_logged_once_a_minute(
    tick_s: float, said: list[str], monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
):
    """The line has the ratio of robot time to wall-clock time, if it is below 0.95."""
    now = [0.0]
    monkeypatch.setattr(clocks.time, "monotonic", lambda: now[0])
    monkeypatch.setattr(clocks.Deadlines, "wait", lambda _: None)
    paced = Pace(1000.0, logging.getLogger("sim"))
    while now[0] < 1.5 * MEASURED_S + REPEAT_S:
        now[0] += tick_s
        paced.wait()
    expected = [f"robot time runs at {ratio} of its pace: this machine is slow" for ratio in 2 * said]
    assert [record.getMessage() for record in caplog.records] == expected


def test_waiting_for_a_controller_that_hangs_is_not_logged_as_a_slow_machine(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
):
    now = [0.0]
    monkeypatch.setattr(clocks.time, "monotonic", lambda: now[0])
    monkeypatch.setattr(clocks.Deadlines, "wait", lambda _: None)
    paced = Pace(1000.0, logging.getLogger("sim"))
    now[0] += 2.0
    paced.restart()
    while now[0] < 2.0 * MEASURED_S:
        now[0] += 0.001
        paced.wait()
    assert caplog.records == []
