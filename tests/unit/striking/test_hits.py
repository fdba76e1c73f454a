"""Hits of a ball: the contact law with the arm's recoil, and the choice and correction of a hit."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from motion.tracking import tracking_acceleration
from robot.description import load_robot
from robot.striking.arm import Arm, Racket
from robot.striking.calibration import calibrate
from robot.striking.choice import NoHit, State, distinct_first
from robot.striking.chooser import Chooser
from robot.striking.contact import ContactLaw
from robot.striking.corrections import Corrections
from robot.striking.estimator import Estimator, NoiseModel
from robot.striking.flight import Ball, Court, Surface
from robot.striking.learning import Learner, LearningError, read, write
from robot.striking.options import Options
from robot.striking.reachability import Reachability
from robot.striking.recoil import CONTINUES_S, Recoil
from robot.striking.simulated_contact import SimulatedContact

BALL = Ball(0.057, 0.033, step=0.001)
RACKET = Racket(0.13, 0.008)
COURT = Court(Surface(0.0, 0.75, 0.8, 0.006))


@pytest.fixture(scope="module")
def config():
    return load_robot()


@pytest.fixture(scope="module")
def arm(config):
    return Arm(config, RACKET, BALL)


@pytest.fixture(scope="module")
def table(config, tmp_path_factory):
    cache = tmp_path_factory.mktemp("reach")
    made = Reachability.of(config, cache, count=6000)
    again = Reachability.of(config, cache, count=6000)
    assert np.array_equal(made.postures, again.postures)
    return made


@pytest.fixture(scope="module")
def calibration(config, arm, table):
    return calibrate(arm, table, SimulatedContact(config, "ball"), hits=120)


@pytest.fixture(scope="module")
def chooser(arm, table, calibration):
    return Chooser(arm, table, COURT, calibration.law)


def following(velocity=(-5.0, 0.0, 4.0), place=(4.0, -0.9, 1.0)):
    estimator = Estimator(BALL, COURT, NoiseModel(1e-5, restitution_std=1e-4, unmodelled=1e-3))
    for time in (0.0, 0.01):
        fall = np.array([0, 0, -9.81]) * time * (time + BALL.step) / 2
        estimator.observe(time, np.array(place) + np.array(velocity) * time + fall)
    return estimator


def path_of(*ball, **kwargs):
    return following(*ball, **kwargs).path(1.8)


def rest(config, time=0.02):
    return State(time, config.home, np.zeros(6), np.zeros(6))


def test_the_racket_velocity_inverts_the_contact_law(arm, table):
    rng, law = np.random.default_rng(0), ContactLaw(0.8, 0.85, bias=np.array([0.1, -0.05, 0.02]))
    mobility = arm.mobility(arm.postures(table.postures[:30]))
    incoming, wanted = rng.normal(size=(2, 30, 3)) + np.array([[[-5, 0, 0]], [[4, 0, 2]]])
    normals = (wanted - incoming) / np.linalg.norm(wanted - incoming, axis=1, keepdims=True)
    normals = law.better_normal(BALL.mass, mobility, incoming, wanted, normals)
    racket = law.racket_velocity(BALL.mass, mobility, incoming, wanted, normals)
    assert law.outgoing(BALL.mass, mobility, incoming, racket, normals) == pytest.approx(wanted, abs=1e-9)
    across = racket - np.sum(racket * normals, axis=1, keepdims=True) * normals
    assert np.linalg.norm(across, axis=1).max() < 0.05 * np.linalg.norm(wanted - incoming, axis=1).min()


def test_simulated_hits_follow_the_contact_law_with_recoil(arm, calibration):
    assert calibration.hits > 100
    assert 0.7 < calibration.law.restitution < 0.9
    assert 0.7 < calibration.law.friction < 0.95
    assert calibration.rms < 0.25
    # The arm's effective mass is only a few times the ball's, so a law for a heavy racket would be wrong.
    n = np.array([[1.0, 0.0, 0.0]])
    mass = 1 / (n[0] @ arm.mobility(arm.postures(arm.config.home[None]))[0] @ n[0] - 1 / BALL.mass)
    assert 0.1 < mass < 1.0


def test_a_chosen_hit_reaches_the_target_and_a_correction_keeps_its_branch(config, chooser, arm):
    path, target, start = path_of(), np.array([4.0, -0.5, 0.0]), rest(config)
    best = next(chooser.choose(path, start, target))
    place, axis = (value[0] for value in arm.chain.pose(best.positions[None]))
    assert place == pytest.approx(best.racket_position, abs=2e-4)
    assert best.side * axis == pytest.approx(best.racket_normal, abs=2e-3)
    left = chooser.law.outgoing(BALL.mass, *best.contact)[0]
    assert left == pytest.approx(best.outgoing, abs=1e-6)
    leaves = best.ball + (best.incoming - left) * chooser.law.duration / 2
    fall = np.array([0, 0, -9.81]) * best.flight_time * (best.flight_time + BALL.step) / 2
    assert leaves + left * best.flight_time + fall == pytest.approx(target + np.array([0, 0, BALL.radius]), abs=1e-3)
    moved = next(chooser.correct(path_of(place=(4.0, -0.88, 1.01)), start, target, best))
    assert np.abs(moved.positions - best.positions).max() < 0.5
    assert abs(moved.time - best.time) <= 0.06 + 1e-9


def test_hits_similar_to_an_earlier_one_are_ordered_last(config, chooser):
    best = next(chooser.choose(path_of(), rest(config), np.array([4.0, -0.5, 0.0])))
    like, other = replace(best, use=7.0), replace(best, positions=best.positions + 0.6)
    assert list(distinct_first([best, like, other])) == [best, other, like]


def test_a_ball_without_a_feasible_hit_is_refused_with_a_reason(config, chooser):
    cases = [
        (path_of(place=(4.0, -6.0, 1.0)), rest(config), "out of reach"),
        (path_of(), rest(config, 3.0), "late"),
    ]
    for path, start, reason in cases:
        with pytest.raises(NoHit) as error:
            chooser.choose(path, start, np.array([4.0, 0.0, 0.0]))
        assert error.value.reason == reason


def test_a_simulated_contact_corrects_the_law(config, chooser, arm, table, calibration):
    contact = SimulatedContact(config, "ball")
    contact.law = calibration.law
    finer = Chooser(arm, table, COURT, calibration.law, simulate=contact)
    target, start = np.array([4.0, -0.5, 0.0]), rest(config)
    best = next(finer.choose(path_of(), start, target))
    plain = replace(next(chooser.choose(path_of(), start, target)))
    assert np.linalg.norm(contact(best) - best.law_error) < max(0.3 * np.linalg.norm(contact(plain)), 0.03)
    assert best.law_error.any()
    plain = Chooser(arm, table, COURT, calibration.law, simulate=contact, may_play=lambda hit: not hit.law_error.any())
    assert not next(plain.choose(path_of(), start, target)).law_error.any()


def test_a_correction_without_a_hit_nearby_searches_all_hits_if_time_permits(config, chooser):
    target = np.array([4.0, -0.5, 0.0])
    best = next(chooser.choose(path_of(), rest(config), target))
    corrections = Corrections(chooser, following(), tries=2)
    hopeless = replace(best, positions=config.home + np.array([-1.5, 0.0, 1.0, 0.0, 0.0, 0.0]), flight_time=0.15)
    found = list(corrections.of(hopeless, rest(config), target))
    assert len(found) == 2
    assert all(hit.flight_time in Options().flights for hit in found)
    with pytest.raises(NoHit):
        next(corrections.of(hopeless, rest(config, best.time - 0.1), target))


def test_a_correction_with_a_larger_error_tries_other_hits_first(config, chooser, monkeypatch):
    target, start, ball = np.array([4.0, -0.5, 0.0]), rest(config), following()
    best = next(chooser.choose(path_of(), start, target))
    expected = [hit.error for hit in Corrections(chooser, ball, tries=2).of(best, start, target)]
    assert len(expected) == 4
    corrections = Corrections(chooser, ball, tries=2, hopeless=0.0)
    monkeypatch.setattr("robot.striking.corrections.BETTER", 9.0)
    assert [hit.error for hit in corrections.of(best, start, target)] == expected[2:] + expected[:2]
    monkeypatch.setattr("robot.striking.corrections.BETTER", 0.0)
    later = Corrections(chooser, ball, tries=9, hopeless=0.0, earliest=9.0)
    times = [hit.time for hit in later.of(best, start, target)]
    assert 2 < len(times) <= 9
    assert min(times) >= best.time - 1e-6


def test_a_swing_that_would_miss_the_ball_is_moved_to_touch_it(config, chooser, arm):
    path, target = path_of(), np.array([4.0, -0.5, 0.0])
    best = next(chooser.choose(path, rest(config), target))
    before = best.time - 0.2
    start = State(before, best.positions - 0.1 * best.velocities, best.velocities / 2, np.zeros(6))
    aside = path_of(place=(4.0, -0.75, 1.0))
    assert not chooser.touches(path, start, target, best)
    assert not chooser.touches(aside, replace(start, time=best.time - 0.3), target, best)
    touch = chooser.touches(aside, start, target, best)[0]
    assert touch.ball == pytest.approx(aside.at(np.array([touch.time]))[0][0])
    assert touch.racket_position - touch.ball == pytest.approx(best.racket_position - best.ball, abs=0.02)
    assert np.abs(touch.positions - best.positions).max() > 0.05
    low, high = arm.stoppable(touch.positions[None], 0.0)
    assert ((touch.velocities >= low[0]) & (touch.velocities <= high[0])).all()
    left = chooser.law.outgoing(BALL.mass, *touch.contact)[0]
    assert left == pytest.approx(touch.outgoing, abs=1e-6)
    assert touch.error > best.error


def test_only_one_of_several_similar_hits_is_simulated(config, chooser, arm, table, calibration):
    simulated = []

    def simulate(choice):
        simulated.append(choice)
        return np.array([0.0, 0.0, 0.1 * len(simulated)])

    finer = Chooser(arm, table, COURT, calibration.law, simulate=simulate)
    best = next(chooser.choose(path_of(), rest(config), np.array([4.0, -0.5, 0.0])))
    near, far = (replace(best, positions=best.positions + step) for step in (0.01, 0.1))
    errors = [finer.with_simulated_contact(choice).law_error[2] for choice in (best, near, far)]
    assert errors == pytest.approx([0.1, 0.1, 0.2])


def test_a_controller_that_counteracts_the_recoil_makes_the_ball_leave_faster(config, chooser, arm, calibration):
    """Unless its torques are constant during the contact, at a low rate."""
    best = next(chooser.choose(path_of(), rest(config), np.array([4.0, -0.5, 0.0])))
    left = []
    slow = replace(config, rate_hz=125.0)
    for robot, alpha in ((config, 0.0), (config, config.alpha), (slow, config.alpha)):
        touch = SimulatedContact(robot, "ball", alpha=alpha).hit(best, 0.5)
        assert touch is not None
        left.append(touch.velocity @ best.racket_normal)
    assert left[1] > 1.02 * left[0]
    assert left[2] == left[0]


def test_the_recoil_of_a_simulated_arm_agrees_with_the_model(config, chooser, arm, calibration):
    """The velocity jump follows from the ball's change of momentum, and the deviation from the tracking law."""
    best = next(chooser.choose(path_of(), rest(config), np.array([4.0, -0.5, 0.0])))
    contact = SimulatedContact(config, "ball")
    contact.law = calibration.law
    left = contact.hit(best, 0.5)
    assert left is not None
    thrown = left.joint_velocities - best.velocities
    jump = arm.response(best.positions, BALL.mass * (best.incoming - left.velocity))
    assert thrown == pytest.approx(jump, abs=0.07 * np.abs(jump).max())
    farthest = Recoil(arm).postures(best)[-1] - best.positions - CONTINUES_S * best.velocities
    jump = arm.response(best.positions, BALL.mass * (best.incoming - best.outgoing))
    still, error, speed = (np.zeros(6), np.zeros(6), np.zeros(6)), np.zeros(6), jump.copy()
    peak = np.zeros(6)
    for _ in range(1000):
        speed += 1e-4 * tracking_acceleration(config.alpha, still, error, speed)
        error += 1e-4 * speed
        peak = np.where(np.abs(error) > np.abs(peak), error, peak)
    assert farthest == pytest.approx(1.2 * peak, rel=0.01)


def test_hits_whose_recoil_would_end_in_the_floor_are_not_chosen(config, chooser, arm, table):
    path, target, recoil = path_of((-5.0, 0.0, 2.0)), np.array([4.5, 0.0, 0.0]), Recoil(arm)
    every = list(chooser.choose(path, rest(config), target, count=100))
    without = [choice for choice in every if not recoil.has_room(choice)]
    assert 0 < len(without) < len(every)
    assert max(choice.ball[2] for choice in without) < 0.2
    careful = Chooser(arm, table, COURT, chooser.law, may_play=recoil.has_room)
    played = careful.choose(path, rest(config), target, count=100)
    assert [hit.time for hit in played] == [hit.time for hit in every if recoil.has_room(hit)]
    corrected = careful.correct(path, rest(config), target, without[0])
    assert all(recoil.has_room(hit) for hit in corrected)
    nothing = Chooser(arm, table, COURT, chooser.law, may_play=lambda _: False)
    with pytest.raises(NoHit) as error:
        nothing.choose(path, rest(config), target)
    assert error.value.reason == "room"


def test_a_ball_that_cannot_reach_the_target_is_blocked(config, chooser, arm):
    path, far = path_of(), np.array([20.0, 0.0, 0.0])
    with pytest.raises(NoHit):
        chooser.choose(path, rest(config), far)
    block = next(chooser.blocks(path, rest(config), far))
    assert block.ball == pytest.approx(path.at(np.array([block.time]))[0][0])
    assert block.racket_normal @ block.incoming == pytest.approx(-np.linalg.norm(block.incoming), rel=0.05)
    assert chooser.law.outgoing(BALL.mass, *block.contact)[0] == pytest.approx(-block.incoming / 2, abs=1e-6)
    assert np.linalg.norm(block.racket_velocity) < 0.25 * np.linalg.norm(block.incoming)
    assert block.error > 1.0
    with pytest.raises(NoHit):
        chooser.blocks(path_of(place=(4.0, -6.0, 1.0)), rest(config), far)


def test_observed_hits_correct_a_wrong_contact_law_which_is_saved(config, chooser, arm, calibration, tmp_path: Path):
    true, law = calibration.law, replace(calibration.law, restitution=0.9 * calibration.law.restitution)
    learner, best = Learner.of(law), next(chooser.choose(path_of(), rest(config), np.array([4.0, -0.5, 0.0])))
    state = best.mobility[None], best.incoming[None], best.racket_velocity[None], best.racket_normal[None]
    rng = np.random.default_rng(0)
    for _ in range(15):
        left = true.outgoing(BALL.mass, *state)[0] + 0.1 * rng.normal(size=3)
        assert learner.observe(best, BALL.mass, left)
    believed = learner.law.outgoing(BALL.mass, *state)[0]
    assert believed == pytest.approx(true.outgoing(BALL.mass, *state)[0], abs=0.1)
    assert not learner.observe(best, BALL.mass, np.full(3, 50.0))
    assert not learner.observe(best, BALL.mass, np.full(3, np.nan))
    file = tmp_path / "arm.json"
    assert read(file, "arm") is None
    write(file, "arm", learner)
    again = read(file, "arm")
    assert again is not None
    assert again.law.restitution == learner.law.restitution
    assert again.hits == 15
    with pytest.raises(LearningError, match="belongs to the robot 'arm'"):
        read(file, "other")
    file.write_text("{}")
    with pytest.raises(LearningError, match="delete it"):
        read(file, "arm")
