"""The same scenario gives the same bytes in other processes and after other runs."""

from pathlib import Path

from harness import Stack, running

from protocol import messages as m
from protocol import topics
from protocol.codec import decode
from tools.demo.strikes import goal

BACK = {"primitive": "forehand", "positions": [0.2, 0.5, 0.8, 0.0, 0.1, 0.0], "duration": 0.6}


def scenario(stack: Stack, seed: int) -> list[bytes]:
    """Play a scenario with noise, a strike, a push, a second goal and a cancel; return the bytes of every state."""
    stack.reset(seed=seed)
    stack.bus.ask(topics.SIM_DISTURB, m.Disturb(kind="sensor_noise", position_std=0.005, velocity_std=0.05))
    stack.step(10)
    first, second = f"first of {seed}", f"second of {seed}"
    reply = stack.bus.ask(topics.GOAL, goal(goal_id=first))
    push = m.Disturb(kind="acceleration", values=[50.0] + [0.0] * 5, start_time=reply.start_time + 0.1, duration=0.2)
    stack.bus.ask(topics.SIM_DISTURB, push)
    stack.step(600)
    stack.goal(**BACK, goal_id=second)
    stack.step(300)
    stack.cancel(second)
    stack.step(400)
    assert [stack.result(name).outcome for name in (first, second)] == ["preempted", "canceled"]
    return stack.state_bodies()


def test_the_same_run_twice_gives_the_same_states(tmp_path: Path):
    """States are equal byte by byte across processes and after another run; another seed gives other states."""
    with running(tmp_path / "one") as stack:
        other, second = scenario(stack, seed=8), scenario(stack, seed=7)
    with running(tmp_path / "two") as stack:
        first = scenario(stack, seed=7)
    assert len(first) == 1311
    assert [tick for tick, pair in enumerate(zip(first, second, strict=True)) if pair[0] != pair[1]] == []
    assert decode(first[-1], m.State).positions != decode(other[-1], m.State).positions
