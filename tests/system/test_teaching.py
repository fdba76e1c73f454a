"""`volley teach` on a running cell: the arm is pushed through a movement, which it then plays."""

import numpy as np
import pytest
from harness import ROBOT, running

from protocol import messages as m
from protocol import topics
from protocol.codec import decode
from tools.shell.__main__ import main

pytestmark = pytest.mark.realtime


def test_a_guided_movement_is_learned_and_played(tmp_path, capsys):
    with running(tmp_path, clock="paced") as stack:
        now = stack.state().time
        for begins, push in ((1.0, 2.0), (2.2, -2.5)):
            values = [0.0, 0.0, push, push, 0.0, 0.0]
            stack.bus.ask(topics.SIM_DISTURB, m.Disturb(kind="acceleration", values=values, start_time=now + begins,
                                                        duration=0.3))  # fmt: skip
        states = stack.listen(topics.STATE)
        assert main(["teach", "swing", "--seconds", "4", "--play", "--connect", stack.endpoint]) == 0
        said = capsys.readouterr()
        assert "the arm yields" in said.err
        assert "succeeded" in said.out
        assert stack.status().fault is None
        assert "swing" in [entry.name for entry in stack.bus.ask(topics.PRIMITIVES, m.Empty()).primitives]
        taken = [decode(states.get(), m.State, 1 << 16) for _ in range(states.qsize())]
        guided = np.array([state.positions for state in taken if state.condition == "guiding"])
        assert np.ptp(guided[:, 2]) > 0.1
        after = np.array([state.positions for state in taken if state.run != taken[0].run])
        assert np.abs(after[0] - guided[-1]).max() < 1e-3
        assert (np.abs(np.diff(after, axis=0)) * ROBOT.rate_hz < ROBOT.limits.velocities).all()
