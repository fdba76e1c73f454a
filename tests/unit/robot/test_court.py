"""The tables [ball], [racket] and [court]: values of the shipped ones, and refusals of invalid ones."""

import mujoco
import pytest

from robot.court import ball_config, court_config, racket_config
from robot.description import load_robot
from robot.schema import BallTable, CourtTable, RacketTable, RobotError

ROBOT = load_robot()
MOVED = [ROBOT.model.body(name).id for name in ROBOT.bodies]


def test_the_shipped_arm_has_a_ball_a_racket_and_a_court():
    ball, racket, court = ROBOT.ball, ROBOT.racket, ROBOT.court
    assert ball and racket and court and court.net
    assert (ball.mass, ball.radius, ball.every, ball.rate_hz) == (0.057, 0.033, 10, 100.0)
    assert (racket.radius, racket.thickness) == (0.13, 0.008)
    assert (court.height, court.net.normal, court.net.half_width) == (0.0, (1.0, 0.0), 2.5)
    assert court.net.top == pytest.approx((2.8, 0.0, 0.5))


def test_the_balls_rate_is_rounded_to_a_whole_number_of_ticks():
    ball = ball_config(BallTable(rate_hz=300.0), ROBOT.model, 1000.0)
    assert ball is not None
    assert (ball.every, ball.rate_hz) == (3, 1000 / 3)


def test_without_geoms_there_is_no_racket_and_no_court():
    assert racket_config(RacketTable(), ROBOT.model, MOVED) is None
    assert court_config(None, ROBOT.model) is None


@pytest.mark.parametrize(
    ("table", "sentence"),
    [
        (BallTable(drag=-1.0), "ball.drag: -1.0 must be 0 or more"),
        (BallTable(magnus=float("nan")), "ball.magnus: nan must be 0 or more"),
        (BallTable(rate_hz=2000.0), "ball.rate_hz: 2000 must be at least 1 and at most rate_hz = 1000"),
        (BallTable(rate_hz=1e-308), "ball.rate_hz: 1e-308 must be at least 1"),
        (RacketTable(geom="strings"), "racket.geom: the model has no geom 'strings'; .*string_bed"),
        (RacketTable(geom="net"), "racket.geom: none of joints.names moves 'net'"),
        (RacketTable(geom="string_bed", restitution=1.5), "racket.restitution: 1.5 must be 0 to 1"),
        (CourtTable(surface="sea"), "court.surface: the model has no geom 'sea'"),
        (CourtTable(surface="string_bed"), "court.surface: 'string_bed' moves; the court must be fixed"),
        (CourtTable(surface="floor", net="floor"), "court.net: 'floor' is not a box"),
        (CourtTable(surface="floor", dwell=1.0), "court.dwell: 1.0 must be 0 to 0.1"),
        (CourtTable(surface="floor", region=((5.0, 3.0), (0.0, 1.0))), "court.region: its x goes from 5 to 3 m"),
    ],
)
def test_an_invalid_table_is_refused_with_its_field(table: BallTable | RacketTable | CourtTable, sentence: str):
    with pytest.raises(RobotError, match=sentence):
        match table:
            case BallTable():
                ball_config(table, ROBOT.model, 1000.0)
            case RacketTable():
                racket_config(table, ROBOT.model, MOVED)
            case CourtTable():
                court_config(table, ROBOT.model)


def test_a_ball_table_for_a_model_without_a_ball_is_refused():
    empty = mujoco.MjModel.from_xml_string("<mujoco/>")
    assert ball_config(None, empty, 1000.0) is None
    with pytest.raises(RobotError, match="the model has no body 'ball' with a free joint"):
        ball_config(BallTable(), empty, 1000.0)
