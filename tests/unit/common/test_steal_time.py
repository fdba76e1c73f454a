"""The kernel's count of each core's time."""

import os

import pytest

from services.common import steal_time

COUNTS = """cpu  30 0 0 70 0 0 0 13 9 9
cpu0 20 0 1 40 0 2 0 8 5 5
cpu2 10 0 0 30 0 0 0 5 4 4
intr 1 2 3
"""


def test_each_core_has_its_own_times():
    """Cores are found by number, as one may be off; a guest's time is part of the user's."""
    assert steal_time.spent(COUNTS) == {0: [20, 0, 1, 40, 0, 2, 0, 8], 2: [10, 0, 0, 30, 0, 0, 0, 5]}


def test_stolen_counts_the_cores_of_this_process(monkeypatch: pytest.MonkeyPatch):
    """Time stolen from other cores does not count."""
    monkeypatch.setattr(steal_time, "_counts", lambda: COUNTS)
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: {1, 2, 3})
    assert steal_time.stolen() == {2: 5}
    assert steal_time.stolen_share() == 13 / (71 + 45)


@pytest.mark.parametrize("counts", ["", "cpu  0 0 0 0 0 0 0 0\ncpu0 0 0 0 0 0 0 0 0\n", "intr 1 2 3"])
def test_a_kernel_without_steal_time(monkeypatch: pytest.MonkeyPatch, counts: str):
    """The share is None."""
    monkeypatch.setattr(steal_time, "_counts", lambda: counts)
    assert steal_time.stolen_share() is None
    assert not any(steal_time.stolen().values())


def test_this_machine_reports_steal_time():
    """There is a count for every core of this process, and it never falls."""
    first, then = steal_time.stolen(), steal_time.stolen()
    assert set(first) == os.sched_getaffinity(0)
    assert all(then[core] >= steps for core, steps in first.items())
