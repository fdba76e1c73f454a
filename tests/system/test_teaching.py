"""`volley teach` on a running cell: the arm is pushed through a movement and then plays it."""

import threading

import numpy as np
import pytest
from harness import ROBOT, Stack, running, wait_for

from protocol import messages as m
from protocol import topics
from protocol.codec import decode
from tools.shell.__main__ import main

pytestmark = pytest.mark.realtime


def push_once_it_yields(stack: Stack) -> None:
    """Wait until the arm is guided, then push it aside and back."""
    wait_for(lambda: stack.state().condition == "guiding", "the arm to yield")
    now = stack.state().time
    for begins, push in ((0.7, 2.0), (1.9, -2.5)):
        values = [0.0, 0.0, push, push, 0.0, 0.0]
        body = m.Disturb(kind="acceleration", values=values, start_time=now + begins, duration=0.3)
        stack.bus.ask(topics.SIM_DISTURB, body)


def test_a_guided_movement_is_learned_and_played(tmp_path, capsys):
    with running(tmp_path, clock="paced") as stack:
        states = stack.listen(topics.STATE)
        pushing = threading.Thread(target=push_once_it_yields, args=(stack,))
        pushing.start()
        assert main(["teach", "swing", "--seconds", "4", "--play", "--connect", stack.endpoint]) == 0
        pushing.join()
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
