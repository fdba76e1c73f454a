"""CPU steal time, and the scenarios that are repeated because of it."""

import time
from collections.abc import Callable
from pathlib import Path

import pytest

from protocol.errors import Refusal
from protocol.messages import Clock
from services.common.cli import Options
from tests.waiting import eventually
from tools.drill.harness.lab import Lab
from tools.drill.harness.steal_monitor import BRAKING_STEPS, PERIOD_S, StealMonitor
from tools.drill.harness.waiting import ScenarioError
from tools.drill.run import MAX_ATTEMPTS, run_scenario
from tools.drill.scenario import Bound, Measured, Scenario, none, timed

JUMPS, LATE = none("jumps"), timed(none("late ticks"))


class Host:
    """The kernel's steal time of two cores, and a clock."""

    def __init__(self) -> None:
        self.steps = {0: 3, 1: 5}
        self.now = 100.0
        self.looks = 0

    def stolen(self) -> dict[int, int]:
        """Return the steps."""
        self.looks += 1
        return dict(self.steps)

    def steal(self, core: int, steps: int, after: float = PERIOD_S) -> None:
        """Let some time pass, and steal a core in it."""
        self.now += after
        self.steps[core] = self.steps.get(core, 0) + steps


@pytest.fixture
def host() -> Host:
    """Return a host whose steal time a test sets."""
    return Host()


@pytest.fixture
def monitor(host: Host) -> StealMonitor:
    """Return a monitor that samples only on request."""
    return StealMonitor(host.stolen, lambda: host.now)


def test_two_samples_in_a_row_are_summed(host: Host, monitor: StealMonitor):
    """A stall may be split between two samples, but not among three."""
    began = host.now
    for expected in (1, 2, 2, 2):
        host.steal(core=0, steps=1)
        assert monitor.peak_steal(began) == expected


def test_two_cores_do_not(host: Host, monitor: StealMonitor):
    """Steal time of different cores is not added."""
    began = host.now
    host.steal(core=0, steps=1)
    host.steal(core=1, steps=1, after=0.0)
    assert monitor.peak_steal(began) == 1


def test_steal_before_does_not_count(host: Host, monitor: StealMonitor):
    """Only steal time after the given time counts."""
    host.steal(core=1, steps=10)
    monitor.sample()
    host.now += 1.0
    assert monitor.peak_steal(host.now) == 0
    assert monitor.peak_steal(100.0) == 10


def test_a_piece_across_the_time_asked_for_counts_from_there(host: Host, monitor: StealMonitor):
    """The part before belongs to an earlier attempt."""
    host.steal(core=0, steps=1)
    between = monitor.sample()
    host.steal(core=0, steps=1)
    assert monitor.peak_steal(between) == 1
    assert monitor.peak_steal(100.0) == 2


def test_a_core_that_comes_and_goes_steals_nothing(host: Host, monitor: StealMonitor):
    """Its total since the system's start is not an increase."""
    host.steal(core=2, steps=1000)
    del host.steps[0]
    assert monitor.peak_steal(100.0) == 0
    host.steal(core=2, steps=1)
    assert monitor.peak_steal(100.0) == 1


def test_it_samples_by_itself_while_entered(host: Host):
    """Steal time is recorded when it happens."""
    with StealMonitor(host.stolen) as monitor:
        began = monitor.sample()
        host.steal(core=0, steps=6)
        looks = host.looks
        assert eventually(lambda: host.looks > looks)
        assert monitor.peak_steal(time.monotonic()) == 0
        assert monitor.peak_steal(began) == 6


@pytest.fixture
def lab(tmp_path: Path, host: Host) -> Lab:
    """A lab whose monitor samples that host."""
    lab = Lab(Options(), tmp_path)
    lab.steal_monitor = StealMonitor(host.stolen, lambda: host.now)
    return lab


def scenario(run: Callable[[Lab], Measured], clock: Clock = "realtime", *others: Bound) -> Scenario:
    """Return a scenario that causes nothing by itself."""
    return Scenario("nothing", "nothing happens", clock, (LATE, *others), run)


def test_a_scenario_with_steal_is_carried_out_again(lab: Lab, host: Host):
    """The outcome has the failures or error of earlier attempts."""
    tries = iter([{"late ticks": 7}, ScenarioError("waited too long"), {"late ticks": 0}])

    def run(_: Lab) -> Measured:
        host.steal(core=0, steps=10, after=1.0)
        measured = next(tries)
        if isinstance(measured, Exception):
            raise measured
        return measured

    outcome = run_scenario(scenario(run), lab)
    assert outcome.held
    assert outcome.earlier_attempts == (
        "100 ms of CPU steal on one core; late ticks: 7",
        "100 ms of CPU steal on one core; ScenarioError: waited too long",
    )
    assert next(tries, None) is None


@pytest.mark.parametrize(
    ("steps", "clock", "measured", "expected"),
    [
        (BRAKING_STEPS, "realtime", {"late ticks": 7, "jumps": 0}, MAX_ATTEMPTS),
        (BRAKING_STEPS - 1, "realtime", {"late ticks": 7, "jumps": 0}, 1),
        (BRAKING_STEPS, "stepped", {"late ticks": 7, "jumps": 0}, 1),
        (BRAKING_STEPS, "realtime", {"late ticks": 7, "jumps": 1}, 1),
        (BRAKING_STEPS, "realtime", {"late ticks": 0, "jumps": 0}, 1),
        (BRAKING_STEPS, "realtime", KeyError("a defect"), 1),
        (BRAKING_STEPS, "realtime", Refusal("bad_message", "a defect", field=""), 1),
        (BRAKING_STEPS, "realtime", Refusal("fault", "the arm has braked", fault=""), MAX_ATTEMPTS),
    ],
    ids=["to no end", "a moment", "stepped", "a jump", "held", "a defect", "a refusal", "a fault"],
)
def test_nothing_else_is(lab: Lab, host: Host, steps: int, clock: Clock, measured: Measured | Exception, expected: int):
    """Repeat only in real time, if only timed bounds failed and the steal time was long, a bounded number of times."""
    tries = 0

    def run(_: Lab) -> Measured:
        nonlocal tries
        tries += 1
        host.steal(core=0, steps=steps)
        if isinstance(measured, Exception):
            raise measured
        return measured

    outcome = run_scenario(scenario(run, clock, JUMPS), lab)
    assert tries == expected
    assert len(outcome.earlier_attempts) == expected - 1
    assert outcome.held == (measured == {"late ticks": 0, "jumps": 0})


def test_a_row_without_a_timed_bound_is_final(lab: Lab, host: Host):
    """However it ends: the soak counts steal itself."""

    def run(_: Lab) -> Measured:
        host.steal(core=0, steps=50)
        raise ScenarioError("waited too long")

    assert run_scenario(Scenario("nothing", "nothing happens", "realtime", (JUMPS,), run), lab).earlier_attempts == ()


def test_earlier_steal_excuses_nothing(lab: Lab, host: Host):
    """The attempt itself must be disturbed."""
    host.steal(core=0, steps=50)
    assert run_scenario(scenario(lambda _: {"late ticks": 7}), lab).earlier_attempts == ()
