"""Segments on the timeline that replace one another."""

import numpy as np

from motion.limits import Limits
from motion.trajectory import Samples
from services.controller.timeline import Segment, Timeline

LIMITS = Limits(np.array([[-1.0, 1.0]]), np.array([2.0]), np.array([10.0]), np.array([100.0]))


def timeline_at(position: float) -> Timeline:
    """Return the timeline of one joint that stays there."""
    return Timeline(np.array([position]), LIMITS, 0.001)


def ramp(start: int, count: int, first: float) -> Segment:
    """Positions first, first + 1, … on one joint."""
    values = first + np.arange(float(count))[:, None]
    return Segment(start, Samples(values, values + 0.1, values + 0.2))


def positions(timeline: Timeline, ticks: range) -> list[float]:
    """Return the position of the joint at each of the ticks."""
    return [float(timeline.at(tick)[0][0]) for tick in ticks]


def test_it_holds_before_and_after_a_segment():
    """Before the first segment it holds its first sample, after the last one its last."""
    timeline = timeline_at(5.0)
    timeline.splice(ramp(10, 3, 20.0))
    assert positions(timeline, range(8, 15)) == [5, 5, 20, 21, 22, 22, 22]
    assert positions(timeline, range(3)) == [5, 5, 5]
    assert [float(values[0]) for values in timeline.at(11)] == [21.0, 21.1, 21.2]
    assert timeline.end == 12


def test_a_segment_replaces_all_that_came_from_its_start_on():
    """It also replaces segments that have not begun, and one that begins at the same tick."""
    timeline = timeline_at(0.0)
    timeline.splice(ramp(10, 10, 100.0))
    timeline.splice(ramp(14, 2, 200.0))
    timeline.splice(ramp(12, 2, 300.0))
    assert positions(timeline, range(9, 16)) == [0, 100, 101, 300, 301, 301, 301]
    timeline.splice(ramp(12, 1, 400.0))
    assert positions(timeline, range(11, 14)) == [101, 400, 400]


def test_the_past_can_be_forgotten():
    """The present and the future stay."""
    timeline = timeline_at(0.0)
    timeline.splice(ramp(10, 5, 100.0))
    timeline.splice(ramp(12, 5, 200.0))
    before = positions(timeline, range(11, 20))
    timeline.forget_before(11)
    assert positions(timeline, range(11, 20)) == before
    timeline.forget_before(12)
    assert positions(timeline, range(12, 20)) == before[1:]


def test_coming_returns_the_samples_of_the_next_ticks():
    """Across segments they are equal to those of the single ticks."""
    timeline = timeline_at(0.0)
    timeline.splice(ramp(10, 5, 100.0))
    timeline.splice(ramp(12, 3, 200.0))
    assert timeline.coming(9, 7).positions[:, 0].tolist() == [0, 100, 101, 200, 201, 202, 202]
    timeline.hold(np.array([7.0]), 5)
    timeline.splice(ramp(20, 3, 300.0))
    for tick in (0, 4, 9, 19, 20, 22, 50):
        coming = timeline.coming(tick, 4)
        rows = [timeline.at(later) for later in range(tick, tick + 4)]
        for column, values in enumerate((coming.positions, coming.velocities, coming.accelerations)):
            assert values.tolist() == [row[column].tolist() for row in rows]


def test_hold_discards_all_segments():
    """The pose is copied, so the caller may change its own array."""
    timeline = timeline_at(0.0)
    timeline.splice(ramp(10, 5, 100.0))
    pose = np.array([7.0])
    timeline.hold(pose, 11)
    pose[0] = 8.0
    assert positions(timeline, range(10, 13)) == [7, 7, 7]
    assert not any(values.any() for values in timeline.at(12)[1:])


def test_an_arm_at_rest_outside_its_limits_stays_where_it_is():
    """A plan that has not begun never begins, however far ahead."""
    timeline = timeline_at(1.01)
    timeline.splice(ramp(1_000_000, 50, 1.01))
    assert timeline.stop(5) == (5, 5)
    assert positions(timeline, range(0, 2_000_000, 1000)) == [1.01] * 2000
