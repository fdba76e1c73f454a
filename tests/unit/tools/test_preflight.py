"""Facts found on a machine, and the promise derived from them."""

import os
import shutil
import subprocess
import sys

import numpy as np
import pytest

from tools.preflight import facts
from tools.preflight.__main__ import main
from tools.preflight.facts import Fact
from tools.preflight.verdict import measure, promise, summarise

GOOD = [Fact("scheduler", "SCHED_FIFO", True, needed=True), Fact("kernel", "PREEMPT_RT", True)]
FACTS = "scheduler", "memory lock", "cores", "governor", "kernel", "host", "receive buffer", "clock source"
PUNCTUAL = np.full(1000, 3.0)


def with_one(late_us: float) -> np.ndarray:
    """Return a punctual sample with one late tick, µs."""
    return np.append(PUNCTUAL, late_us)


def test_refused_privileges_are_reported():
    missing = ["SCHED_FIFO 50: [Errno 1] Operation not permitted", "mlockall: Cannot allocate memory"]
    scheduler, memory, slack = facts.granted(missing)
    assert (scheduler.good, memory.good, slack.good) == (False, False, True)
    assert "not permitted" in scheduler.found
    assert "Cannot allocate" in memory.found
    assert all(fact.good for fact in facts.granted([]))


@pytest.mark.parametrize(
    ("version", "realtime", "found", "good"),
    [
        ("#1 SMP PREEMPT_RT Debian 6.12.9-1", "", "PREEMPT_RT", True),
        ("#1 SMP PREEMPT Debian", "1", "PREEMPT_RT", True),
        ("#1 SMP PREEMPT_DYNAMIC Debian", "", "PREEMPT_DYNAMIC", False),
        ("#1 SMP Debian", "0", "no preemption model named", False),
    ],
)
def test_the_kernels_preemption_is_recognised(version, realtime, found, good):
    fact = facts.kernel(version, realtime)
    assert (fact.found, fact.good) == (found, good)


def test_facts_about_cores_governor_host_buffer_and_clock():
    assert [facts.cores(count, "").good for count in (2, 4, 8)] == [False, True, True]
    assert "isolated: 2-3" in facts.cores(4, "2-3").found
    assert facts.governor(["performance"] * 4).good is True
    assert facts.governor(["performance", "powersave"]).good is False
    assert facts.governor([]).good is None
    assert [facts.host(share).good for share in (0.0, 0.0004, None)] == [True, False, None]
    assert facts.host(1e-6).good is True
    assert "0.040%" in facts.host(0.0004).found
    assert [facts.receive_buffer(size).good for size in (212992, 4 << 20, None)] == [False, True, None]
    assert [facts.clock(name).good for name in ("tsc", "hpet", "")] == [True, False, None]


def test_lateness_is_summarised():
    sample = summarise(np.array([0.0, 10.0, 20.0, 260.0, 900.0]))
    assert (sample.count, sample.median_us, sample.max_us, sample.late, sample.missed) == (5, 20.0, 900.0, 2, False)
    assert summarise(np.array([1000.0])).missed
    assert measure(0.02).count == 20


@pytest.mark.parametrize(
    ("late_us", "found", "fit", "sentence"),
    [
        (PUNCTUAL, GOOD, True, "1 kHz under load"),
        (with_one(300.0), GOOD, True, "1 ticks later than 250 µs"),
        (PUNCTUAL, [*GOOD, Fact("governor", "powersave", False)], True, "see to governor"),
        (PUNCTUAL, [*GOOD, Fact("governor", "unknown", None)], True, "1 kHz under load"),
        (PUNCTUAL, [*GOOD, facts.host(0.0004)], True, "now and then a stolen core"),
        (PUNCTUAL, [*GOOD, facts.receive_buffer(212992)], True, "1 kHz under load"),
        (PUNCTUAL, [Fact("scheduler", "no", False, needed=True)], False, "scheduler was refused"),
        (with_one(1500.0), GOOD, False, "not 1 kHz: the worst of 1001 ticks came 1500 µs late"),
    ],
)
def test_the_promise_follows_from_lateness_and_facts(late_us, found, fit, sentence):
    said_fit, said = promise(summarise(late_us), found)
    assert said_fit == fit
    assert sentence in said


@pytest.mark.parametrize("prefix", [[], ["setpriv", "--bounding-set=-all"]], ids=["as is", "no privileges"])
def test_preflight_runs_with_and_without_privileges(prefix):
    """It prints all facts and exits with 0 or 1, according to its promise."""
    if prefix and (os.getuid() != 0 or not shutil.which(prefix[0])):
        pytest.skip("without root there are no privileges to drop")
    command = [*prefix, sys.executable, "-m", "tools.preflight", "--seconds", "0.1"]
    done = subprocess.run(command, check=False, capture_output=True, text=True, env={"COLUMNS": "120"})
    assert done.returncode in (0, 1), done.stderr
    assert done.stderr == ""
    for name in (*FACTS, "1 ms loop"):
        assert name in done.stdout
    assert ("This machine promises not" in done.stdout or "was refused" in done.stdout) == (done.returncode == 1)
    if prefix:
        assert "SCHED_FIFO 50: " in done.stdout
        assert done.returncode == 1


@pytest.mark.parametrize("seconds", ["-1", "0", "nan", "inf"])
def test_an_invalid_duration_is_refused(seconds, monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", ["preflight", f"--seconds={seconds}"])
    assert main() == 2
    assert capsys.readouterr().err == f"preflight: seconds is {seconds}; it must lie between 0.1 and 3600\n"
