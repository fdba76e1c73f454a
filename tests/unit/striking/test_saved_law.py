"""The saved contact law."""

import gc
from pathlib import Path

import numpy as np

from robot.striking.contact import ContactLaw
from robot.striking.learning import Learner, write


def test_saving_a_law_makes_no_reference_cycle(tmp_path: Path):
    """The striker saves it after each hit, and never collects garbage."""
    learner = Learner.of(ContactLaw(0.5, 0.2, 0.005, np.zeros(3)))
    gc.collect()
    gc.disable()
    try:
        write(tmp_path / "arm.json", "arm", learner)
        assert gc.collect() == 0
    finally:
        gc.enable()
