import pytest

from benchmarks.table_tennis.__main__ import VARIANTS, wilson
from benchmarks.table_tennis.player import Player
from benchmarks.table_tennis.scene import NotInstalled, environment


def test_wilsons_interval():
    assert wilson(98, 100) == pytest.approx((0.9300, 0.9945), abs=1e-4)


@pytest.mark.parametrize("name", ["calm", "noise"])
def test_a_ball_of_fancy_gym_is_returned(name: str, tmp_path):
    try:
        environment().close()
    except NotInstalled as missing:
        pytest.skip(str(missing))
    player = Player(VARIANTS[name], tmp_path, 0)
    ball = player.play(500_000)
    assert ball.hit
    assert ball.returned
    assert ball.success
    assert not ball.violations
