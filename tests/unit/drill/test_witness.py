"""What the host of the machine withholds, and which tries that excuses."""

import time
from pathlib import Path

import pytest

from services.drill.lab import Lab
from services.drill.run import TRIES, carry_out
from services.drill.scenario import Scenario, none
from services.drill.witness import LONG_S, WINDOW_S, Witness
from services.host import STEP_S, stolen, stolen_share
from services.options import Options
from tests.waiting import eventually


class Host:
    """Says how many steps two cores have been withheld."""

    def __init__(self) -> None:
        self.steps = [3, 5]

    def __call__(self) -> list[int]:
        """Return the steps."""
        return list(self.steps)


@pytest.fixture
def host() -> Host:
    """A host that withholds what a test says."""
    return Host()


def test_this_machine_tells_of_each_core():
    """As many counts as it has cores, and a share of all of the time."""
    assert len(stolen()) > 0
    share = stolen_share()
    assert share is not None
    assert 0 <= share < 1


def test_the_most_of_one_core_at_once_counts(host: Host):
    """Of two looks that follow each other the sum, of two cores or two times not."""
    witness = Witness(host)
    began = time.monotonic()
    assert witness.withheld_s(began) == 0.0
    host.steps = [4, 6]
    assert witness.withheld_s(began) == STEP_S
    assert not witness.excuses(began)
    host.steps = [5, 6]
    assert witness.withheld_s(began) == LONG_S == 2 * STEP_S
    assert witness.excuses(began)
    time.sleep(WINDOW_S)
    host.steps = [6, 6]
    later = time.monotonic()
    assert witness.withheld_s(later) == STEP_S
    assert witness.withheld_s(began) == LONG_S


def test_it_looks_by_itself(host: Host):
    """While it is entered: a rise long ago counts at its own time."""
    with Witness(host) as witness:
        began = time.monotonic()
        host.steps = [9, 5]
        eventually(lambda: bool(witness._rises))
        host.steps = [9, 5]
        after = time.monotonic()
        assert witness.withheld_s(began) == 6 * STEP_S
        assert witness.withheld_s(after) == 0.0


def test_a_kernel_that_does_not_tell_excuses_nothing():
    """No cores, no excuse."""
    witness = Witness(list)
    assert witness.withheld_s(0.0) == 0.0


@pytest.fixture
def lab(tmp_path: Path, host: Host) -> Lab:
    """A lab whose witness asks that host."""
    lab = Lab(Options(), tmp_path)
    lab.witness = Witness(host)
    return lab


def falling_short(host: Host, tries: int, withheld: int, clock: str = "realtime") -> tuple[Scenario, list[int]]:
    """Return a scenario that falls short in its first `tries`, as a core is withheld for so many steps; its tries."""
    jumps: list[int] = []

    def run(_: Lab) -> dict[str, float | str]:
        jumps.append(len(jumps) < tries)
        host.steps[0] += withheld * jumps[-1]
        return {"jumps": jumps[-1]}

    return Scenario("nothing", "nothing happens", clock, (none("jumps"),), run), jumps  # type: ignore[arg-type]


def test_what_the_host_has_done_is_tried_again(lab: Lab, host: Host):
    """And told."""
    scenario, tries = falling_short(host, tries=2, withheld=10)
    outcome = carry_out(scenario, lab)
    assert outcome.held
    assert outcome.withheld == (10 * STEP_S, 10 * STEP_S)
    assert len(tries) == 3


@pytest.mark.parametrize(
    ("withheld", "clock", "expected"), [(1, "realtime", 1), (10, "stepped", 1), (10, "realtime", TRIES)]
)
def test_nothing_else_is(lab: Lab, host: Host, withheld: int, clock: str, expected: int):
    """Not for a moment withheld, not on the stepped clock, and not for ever."""
    scenario, tries = falling_short(host, 100, withheld, clock)
    assert not carry_out(scenario, lab).held
    assert len(tries) == expected


def test_a_try_that_holds_is_the_last(lab: Lab, host: Host):
    """Whatever the host has withheld."""
    scenario, tries = falling_short(host, tries=0, withheld=10)
    host.steps[1] += 50
    outcome = carry_out(scenario, lab)
    assert outcome.held
    assert outcome.withheld == ()
    assert len(tries) == 1
