"""Thousands of mutated messages: no process ends, nothing moves, every refusal has a code."""

import random
from pathlib import Path

from services.common.cli import Options
from tests.cores import LOOP_CORE
from tools.drill.harness.lab import Lab
from tools.drill.harness.mutations import MUTATIONS, mutate
from tools.drill.run import run_scenario
from tools.drill.table import SCENARIOS


def test_mutations_are_the_same_for_the_same_seed():
    """Equal seeds give equal mutations, and there are many different ones, of an empty body too."""
    body = {"name": "short_demo", "positions": [1.0, 2.0], "data": b"123"}
    for wrong in (body, {}):
        once, again = ([mutate(wrong, rng) for _ in range(500)] for rng in (random.Random(1), random.Random(1)))
        assert once == again
        assert len(set(once)) > 5 * len(MUTATIONS)


def test_five_thousand_mutated_messages(tmp_path: Path):
    """Every bound of the drill's fuzzing scenario holds."""
    with Lab(Options(loop_core=LOOP_CORE), tmp_path) as lab:
        outcome = run_scenario(SCENARIOS["fuzz"], lab)
    assert outcome.held, outcome
