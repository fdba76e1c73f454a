"""What the host of the machine withholds, and which tries are repeated for it."""

import time
from collections.abc import Callable
from pathlib import Path

import pytest

from protocol.errors import Refusal
from protocol.messages import Clock
from services.common.cli import Options
from tests.waiting import eventually
from tools.drill.harness.cell import Broken
from tools.drill.harness.lab import Lab
from tools.drill.harness.steal_monitor import LONG, PERIOD_S, StealMonitor
from tools.drill.run import TRIES, carry_out
from tools.drill.scenario import Bound, Measured, Scenario, none, timed

JUMPS, LATE = none("jumps"), timed(none("late ticks"))


class Host:
    """Says how many steps two cores have been withheld, by a clock of its own."""

    def __init__(self) -> None:
        self.steps = {0: 3, 1: 5}
        self.now = 100.0

    def stolen(self) -> dict[int, int]:
        """Return the steps."""
        return dict(self.steps)

    def withhold(self, core: int, steps: int, after: float = PERIOD_S) -> None:
        """Let some time pass, and withhold a core in it."""
        self.now += after
        self.steps[core] = self.steps.get(core, 0) + steps


@pytest.fixture
def host() -> Host:
    """A host that withholds what a test says."""
    return Host()


@pytest.fixture
def witness(host: Host) -> StealMonitor:
    """A witness that looks when it is asked to."""
    return StealMonitor(host.stolen, lambda: host.now)


def test_two_looks_in_a_row_count_together(host: Host, witness: StealMonitor):
    """A piece may lie across them; three looks are not one piece."""
    began = host.now
    for expected in (1, 2, 2, 2):
        host.withhold(core=0, steps=1)
        assert witness.withheld(began) == expected


def test_two_cores_do_not(host: Host, witness: StealMonitor):
    """Half of it away from each is no core away."""
    began = host.now
    host.withhold(core=0, steps=1)
    host.withhold(core=1, steps=1, after=0.0)
    assert witness.withheld(began) == 1


def test_what_was_before_does_not_count(host: Host, witness: StealMonitor):
    """Only that since the time asked for."""
    host.withhold(core=1, steps=10)
    witness.look()
    host.now += 1.0
    assert witness.withheld(host.now) == 0
    assert witness.withheld(100.0) == 10


def test_a_piece_across_the_time_asked_for_counts_from_there(host: Host, witness: StealMonitor):
    """Its first part was another try's."""
    host.withhold(core=0, steps=1)
    between = witness.look()
    host.withhold(core=0, steps=1)
    assert witness.withheld(between) == 1
    assert witness.withheld(100.0) == 2


def test_a_core_that_comes_and_goes_steals_nothing(host: Host, witness: StealMonitor):
    """Its count since the start of the system is not news."""
    host.withhold(core=2, steps=1000)
    del host.steps[0]
    assert witness.withheld(100.0) == 0
    host.withhold(core=2, steps=1)
    assert witness.withheld(100.0) == 1


def test_it_looks_by_itself_while_entered(host: Host):
    """So that what was withheld counts at its own time."""
    with StealMonitor(host.stolen) as witness:
        began = witness.look()
        host.withhold(core=0, steps=6)
        assert eventually(lambda: witness._rises)
        assert witness.withheld(began) == 6
        assert witness.withheld(time.monotonic()) == 0


@pytest.fixture
def lab(tmp_path: Path, host: Host) -> Lab:
    """A lab whose witness asks that host."""
    lab = Lab(Options(), tmp_path)
    lab.witness = StealMonitor(host.stolen, lambda: host.now)
    return lab


def scenario(run: Callable[[Lab], Measured], clock: Clock = "realtime", *others: Bound) -> Scenario:
    """Return a scenario that causes nothing by itself."""
    return Scenario("nothing", "nothing happens", clock, (LATE, *others), run)


def test_what_the_host_has_done_is_carried_out_again(lab: Lab, host: Host):
    """And told with what fell short, or broke off."""
    tries = iter([{"late ticks": 7}, Broken("waited in vain"), {"late ticks": 0}])

    def run(_: Lab) -> Measured:
        host.withhold(core=0, steps=10, after=1.0)
        measured = next(tries)
        if isinstance(measured, Exception):
            raise measured
        return measured

    outcome = carry_out(scenario(run), lab)
    assert outcome.held
    assert outcome.before == (
        "the host withheld a core for 100 ms; late ticks: 7",
        "the host withheld a core for 100 ms; Broken: waited in vain",
    )
    assert next(tries, None) is None


@pytest.mark.parametrize(
    ("steps", "clock", "measured", "expected"),
    [
        (LONG, "realtime", {"late ticks": 7, "jumps": 0}, TRIES),
        (LONG - 1, "realtime", {"late ticks": 7, "jumps": 0}, 1),
        (LONG, "stepped", {"late ticks": 7, "jumps": 0}, 1),
        (LONG, "realtime", {"late ticks": 7, "jumps": 1}, 1),
        (LONG, "realtime", {"late ticks": 0, "jumps": 0}, 1),
        (LONG, "realtime", KeyError("a defect"), 1),
        (LONG, "realtime", Refusal("bad_message", "a defect", field=""), 1),
        (LONG, "realtime", Refusal("fault", "the arm has braked", fault=""), TRIES),
    ],
    ids=["to no end", "a moment", "stepped", "a jump", "held", "a defect", "a refusal", "a fault"],
)
def test_nothing_else_is(lab: Lab, host: Host, steps: int, clock: Clock, measured: Measured | Exception, expected: int):
    """Only what a core's absence may move, in real time, where one was absent for long; and not for ever."""
    tries = 0

    def run(_: Lab) -> Measured:
        nonlocal tries
        tries += 1
        host.withhold(core=0, steps=steps)
        if isinstance(measured, Exception):
            raise measured
        return measured

    outcome = carry_out(scenario(run, clock, JUMPS), lab)
    assert tries == expected
    assert len(outcome.before) == expected - 1
    assert outcome.held == (measured == {"late ticks": 0, "jumps": 0})


def test_a_row_without_a_timed_bound_is_final(lab: Lab, host: Host):
    """However it ends: the soak counts what the host does by itself."""

    def run(_: Lab) -> Measured:
        host.withhold(core=0, steps=50)
        raise Broken("waited in vain")

    assert carry_out(Scenario("nothing", "nothing happens", "realtime", (JUMPS,), run), lab).before == ()


def test_what_was_withheld_before_excuses_nothing(lab: Lab, host: Host):
    """A try has to be disturbed itself."""
    host.withhold(core=0, steps=50)
    assert carry_out(scenario(lambda _: {"late ticks": 7}), lab).before == ()
