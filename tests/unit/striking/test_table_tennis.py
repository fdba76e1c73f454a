from pathlib import Path

import numpy as np
import pytest

from benchmarks.table_tennis.balls import Ball, append, read, wilson
from benchmarks.table_tennis.cell import write_robot
from benchmarks.table_tennis.player import Player
from benchmarks.table_tennis.resuming import ResumableRun
from benchmarks.table_tennis.scene import BALL, RACKET, NotInstalled, environment, robot
from benchmarks.table_tennis.variants import VARIANTS
from robot.description import load_robot
from robot.striking.arm import Arm
from robot.striking.choice import Choice
from robot.striking.simulated_contact import SimulatedContact


def test_wilson_interval_of_98_successes_in_100():
    assert wilson(98, 100) == pytest.approx((0.9300, 0.9945), abs=1e-4)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Directory with the cached reachability table, whose computation takes seconds."""
    return tmp_path_factory.mktemp("table")


@pytest.mark.parametrize(
    ("name", "seed"),
    [
        ("calm", 500_000),
        ("noise", 500_000),
        ("noise", 70_720),  # corrections of the first hit get worse and worse
        ("switching", 70_005),  # all late hits are refused
    ],
)
def test_a_ball_of_fancy_gym_is_returned(name: str, seed: int, folder: Path, tmp_path: Path):
    try:
        environment().close()
    except NotInstalled as missing:
        pytest.skip(str(missing))
    ball = Player(VARIANTS[name], folder).play(seed)
    assert ball.hit
    assert ball.returned
    assert ball.success
    assert not ball.violations
    assert not ball.arm_violations
    append(tmp_path / "balls.jsonl", name, seed, ball)
    assert read(tmp_path / "balls.jsonl", name) == {seed: ball}


def test_an_invalid_line_of_results_is_refused_with_its_number(tmp_path):
    path = tmp_path / "balls.jsonl"
    path.write_text("{}\n")
    with pytest.raises(ValueError, match="line 1 cannot be read as a ball"):
        read(path, "calm")


def test_a_run_continues_where_it_was_interrupted(tmp_path):
    """Balls in the file are not played again; other variants and seeds in it are ignored."""
    path = tmp_path / "balls.jsonl"
    append(path, "noise", 4, Ball(hit=True))
    first = ResumableRun("calm", range(3, 7), path)
    for seed, _ in first.play(lambda seed: Ball(corrections=seed)):
        if seed == 4:
            break
    later = ResumableRun("calm", range(4, 8), path)
    assert later.remaining == [5, 6, 7]
    assert [seed for seed, _ in later.play(lambda seed: Ball(corrections=seed))] == [5, 6, 7]
    assert {seed: ball.corrections for seed, ball in later.balls.items()} == {4: 4, 5: 5, 6: 6, 7: 7}
    assert list(read(path, "calm")) == [3, 4, 5, 6, 7]


def test_a_contact_in_the_services_scene_agrees_with_the_environments(tmp_path):
    """The services' ball has a free joint, the environment's three slides, so a hit must not rotate it."""
    try:
        own = robot(tmp_path)
    except NotInstalled as missing:
        pytest.skip(str(missing))
    theirs = load_robot(write_robot(tmp_path))
    assert theirs.ball
    assert theirs.ball.mass == pytest.approx(BALL.mass)
    incoming = np.array([2.0, 0.3, -1.0])
    touches, normal = [], np.zeros(3)
    for config, ball in ((own, "target_ball"), (theirs, "ball")):
        arm = Arm(config, RACKET, BALL)
        centre, normal = (value[0] for value in arm.chain.pose(config.home[None]))
        speeds = np.zeros(len(config.home))
        nothing = np.zeros(3)
        choice = Choice(
            0.0, 0.0, config.home, speeds, 0.5, nothing, centre + arm.offset * normal, incoming - 3 * normal, incoming,
            nothing, centre, normal, nothing, 1, np.eye(3), 0.0, 0.0,
        )  # fmt: skip
        touch = SimulatedContact(config, ball).hit(choice, 0.5)
        assert touch
        touches.append(touch)
    assert touches[0].velocity == pytest.approx(touches[1].velocity, abs=1e-3)
    assert abs(touches[0].velocity @ normal) > 0.5
