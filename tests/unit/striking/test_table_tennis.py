import pytest

from benchmarks.table_tennis.balls import append, read, wilson
from benchmarks.table_tennis.player import Player
from benchmarks.table_tennis.scene import NotInstalled, environment
from benchmarks.table_tennis.variants import VARIANTS


def test_wilsons_interval():
    assert wilson(98, 100) == pytest.approx((0.9300, 0.9945), abs=1e-4)


@pytest.mark.parametrize("name", ["calm", "noise"])
def test_a_ball_of_fancy_gym_is_returned(name: str, tmp_path):
    try:
        environment().close()
    except NotInstalled as missing:
        pytest.skip(str(missing))
    ball = Player(VARIANTS[name], tmp_path).play(500_000)
    assert ball.hit
    assert ball.returned
    assert ball.success
    assert not ball.violations
    assert not ball.arm_violations
    append(tmp_path / "balls.jsonl", name, 500_000, ball)
    assert read(tmp_path / "balls.jsonl", name) == {500_000: ball}


def test_a_line_that_is_no_ball_is_named(tmp_path):
    path = tmp_path / "balls.jsonl"
    path.write_text("{}\n")
    with pytest.raises(ValueError, match="line 1 is no ball"):
        read(path, "calm")
