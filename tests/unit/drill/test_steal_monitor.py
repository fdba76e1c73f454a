"""CPU steal time, and the repetition of scenarios because of it."""

import time
from collections.abc import Callable
from pathlib import Path

import pytest

from protocol.errors import Refusal
from protocol.messages import Clock
from services.common.cli import Options
from tools.drill.harness.lab import Lab
from tools.drill.harness.steal_monitor import BRAKING_STEPS, PERIOD_S, StealMonitor
from tools.drill.harness.waiting import ScenarioError, eventually
from tools.drill.run import MAX_ATTEMPTS, run_scenario
from tools.drill.scenario import Bound, Measured, Scenario, none, timed

JUMPS, LATE = none("jumps"), timed(none("late ticks"))


class Host:
    """Fake steal time of two cores, and a clock."""

    def __init__(self) -> None:
        self.steps = {0: 3, 1: 5}
        self.now = 100.0
        self.reads = 0

    def stolen(self) -> dict[int, int]:
        """Return the total steal time of each core in kernel steps."""
        self.reads += 1
        return dict(self.steps)

    def steal(self, core: int, steps: int, after: float = PERIOD_S) -> None:
        """Advance the clock by `after`, s, and the core's steal time by `steps`."""
        self.now += after
        self.steps[core] = self.steps.get(core, 0) + steps


@pytest.fixture
def host() -> Host:
    """A host whose steal time is set by the test."""
    return Host()


@pytest.fixture
def monitor(host: Host) -> StealMonitor:
    """A monitor that samples only on request."""
    return StealMonitor(host.stolen, lambda: host.now)


def test_steal_time_of_two_consecutive_samples_is_summed(host: Host, monitor: StealMonitor):
    """A stall can be split between two samples, but not among three."""
    began = host.now
    for expected in (1, 2, 2, 2):
        host.steal(core=0, steps=1)
        assert monitor.peak_steal(began) == expected


def test_steal_time_of_different_cores_is_not_summed(host: Host, monitor: StealMonitor):
    began = host.now
    host.steal(core=0, steps=1)
    host.steal(core=1, steps=1, after=0.0)
    assert monitor.peak_steal(began) == 1


def test_steal_time_before_the_given_time_does_not_count(host: Host, monitor: StealMonitor):
    host.steal(core=1, steps=10)
    monitor.sample()
    host.now += 1.0
    assert monitor.peak_steal(host.now) == 0
    assert monitor.peak_steal(100.0) == 10


def test_of_two_samples_only_the_one_after_the_given_time_counts(host: Host, monitor: StealMonitor):
    """The earlier one belongs to an earlier attempt."""
    host.steal(core=0, steps=1)
    between = monitor.sample()
    host.steal(core=0, steps=1)
    assert monitor.peak_steal(between) == 1
    assert monitor.peak_steal(100.0) == 2


def test_a_core_that_appears_or_disappears_adds_no_steal_time(host: Host, monitor: StealMonitor):
    """The total of a new core, counted since the system's start, is not an increase."""
    host.steal(core=2, steps=1000)
    del host.steps[0]
    assert monitor.peak_steal(100.0) == 0
    host.steal(core=2, steps=1)
    assert monitor.peak_steal(100.0) == 1


def test_the_monitor_samples_periodically_as_a_context_manager(host: Host):
    with StealMonitor(host.stolen) as monitor:
        began = monitor.sample()
        host.steal(core=0, steps=6)
        reads = host.reads
        assert eventually(lambda: host.reads > reads)
        assert monitor.peak_steal(time.monotonic()) == 0
        assert monitor.peak_steal(began) == 6


@pytest.fixture
def lab(tmp_path: Path, host: Host) -> Lab:
    """A lab whose monitor samples the fake host."""
    lab = Lab(Options(), tmp_path)
    lab.steal_monitor = StealMonitor(host.stolen, lambda: host.now)
    return lab


def scenario(run: Callable[[Lab], Measured], clock: Clock = "realtime", *others: Bound) -> Scenario:
    """Return a scenario with a bound on late ticks and `others`."""
    return Scenario("nothing", "nothing happens", (LATE, *others), run, clock)


def test_a_scenario_disturbed_by_steal_time_is_repeated(lab: Lab, host: Host):
    """The outcome lists the failures of earlier attempts."""
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
def test_only_timed_bounds_under_steal_time_are_repeated(
    lab: Lab, host: Host, steps: int, clock: Clock, measured: Measured | Exception, expected: int
):
    """Only in real time, if no other bound failed and the steal time was long, at most MAX_ATTEMPTS times."""
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


def test_a_scenario_without_a_timed_bound_is_not_repeated(lab: Lab, host: Host):
    """Even after an error; the soak accounts for steal time itself."""

    def run(_: Lab) -> Measured:
        host.steal(core=0, steps=50)
        raise ScenarioError("waited too long")

    assert run_scenario(Scenario("nothing", "nothing happens", (JUMPS,), run, "realtime"), lab).earlier_attempts == ()


def test_steal_time_before_the_attempt_does_not_repeat_it(lab: Lab, host: Host):
    host.steal(core=0, steps=50)
    assert run_scenario(scenario(lambda _: {"late ticks": 7}), lab).earlier_attempts == ()
