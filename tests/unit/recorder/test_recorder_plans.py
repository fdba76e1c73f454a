"""Plans and their limits in the trace: when a curve begins, ends and breaks."""

import weakref
from pathlib import Path

import numpy as np

from protocol.topics import ENDED, PLAN, STATE
from services.recorder.blueprint import build_blueprint
from services.recorder.context import Context
from services.recorder.planned_curves import PlannedCurves, planned_motion
from services.recorder.writer import TraceWriter
from tests.unit.recorder.recorder_messages import RUN, plan, result, state
from tests.unit.recorder.recorder_to_file import CONFIG, RecorderToFile, joints


def test_a_plan_is_written_as_time_passes_and_reads_back(recorder: RecorderToFile) -> None:
    published = plan(0.010, count=40)
    recorder.publish(STATE, *(state(tick) for tick in range(20)))
    recorder.publish(PLAN, published)
    recorder.end_batch()
    recorder.publish(STATE, *(state(tick) for tick in range(20, 90)))
    trace = recorder.read()
    positions = np.frombuffer(published.positions).reshape(40, 6)
    assert np.array_equal(joints(trace, "/joints/{}/position/planned"), positions)
    assert np.array_equal(
        joints(trace, "/joints/{}/velocity/planned"), np.frombuffer(published.velocities).reshape(40, 6)
    )
    accelerations = np.frombuffer(published.accelerations).reshape(40, 6)
    assert np.array_equal(joints(trace, "/joints/{}/acceleration/planned"), accelerations)
    assert np.array_equal(joints(trace, "/joints/{}/position/demonstrated"), positions[:39] / 2)
    shown = np.frombuffer(published.demonstration).reshape(-1, 6)
    assert trace.column("/plans", "deviation").values == [[np.abs(positions[: len(shown)] - shown).max()]]
    planned = trace.column("/joints/joint_1/position/planned")
    assert np.array_equal(planned.ticks(), range(10, 50))
    assert planned.times["tick"][-1] == 50  # the curve is broken
    target = trace.column("/joints/joint_3/position/target")
    assert (target.ticks().tolist(), target.array().tolist()) == ([48], [positions[38, 2]])


def test_limits_are_the_plans_while_it_lasts_and_the_robots_otherwise(recorder: RecorderToFile) -> None:
    recorder.publish(STATE, *(state(tick) for tick in range(5)))
    recorder.end_batch()
    recorder.publish(PLAN, plan(0.010, count=40))
    recorder.publish(STATE, *(state(tick) for tick in range(5, 90)))
    trace = recorder.read()
    own = CONFIG.limits.positions[0].tolist()
    bounds = trace.column("/joints/joint_1/position/limits")
    assert bounds.values == [own, [-1.0, 1.5], own]
    assert bounds.ticks().tolist() == [0, 10, 50]
    assert trace.column("/joints/joint_2/velocity/limits").values[1] == [-4.0, 4.0]


def test_limits_that_do_not_change_are_repeated_every_second(recorder: RecorderToFile) -> None:
    """A view of the last seconds then shows them."""
    for first in range(0, 2400, 400):
        recorder.publish(STATE, *(state(tick) for tick in range(first, first + 400)))
        recorder.end_batch()
    assert recorder.read().column("/joints/joint_1/velocity/limits").ticks().tolist() == [0, 1199, 2399]


def test_quantities_that_a_plan_does_not_limit_have_no_limits_meanwhile(recorder: RecorderToFile) -> None:
    """This plan limits the position of joint_1 only, and no acceleration."""
    recorder.publish(STATE, *(state(tick) for tick in range(90)))
    recorder.publish(PLAN, plan(0.010, count=40))
    trace = recorder.read()
    assert trace.column("/joints/joint_1/position/limits").ticks().tolist() == [10, 50]
    for path in ("/joints/joint_2/position/limits", "/joints/joint_1/acceleration/limits"):
        assert trace.column(path).ticks().tolist() == [50], path


def test_a_replaced_plan_ends_where_the_next_begins(recorder: RecorderToFile) -> None:
    recorder.publish(STATE, *(state(tick) for tick in range(30)))
    recorder.publish(PLAN, plan(0.010, count=60))
    recorder.end_batch()
    after = plan(0.040, count=30, goal_id="g2")
    recorder.publish(PLAN, after)
    recorder.publish(STATE, *(state(tick) for tick in range(30, 100)))
    trace = recorder.read()
    assert np.array_equal(trace.column("/joints/joint_1/position/planned").ticks(), range(10, 70))
    positions = np.frombuffer(after.positions).reshape(30, 6)
    assert np.array_equal(trace.scalars("/joints/joint_1/position/planned")[30:], positions[:, 0])


def test_a_plan_that_is_replaced_before_it_begins_is_dropped(tmp_path: Path) -> None:
    """With the stepped clock thousands may come without a tick in between, each of up to 17 MB."""
    context = Context(TraceWriter(build_blueprint(CONFIG, live=False), tmp_path / "trace.rrd", None), CONFIG)
    curves = PlannedCurves(context)
    first = planned_motion(plan(0.010), context)
    samples = weakref.ref(first.curves["position"])
    curves.add(first)
    del first
    assert samples() is not None
    curves.add(planned_motion(plan(0.010, goal_id="g2"), context))
    assert samples() is None


def test_a_correction_is_an_event_with_its_phase_and_breaks_the_curves(recorder: RecorderToFile) -> None:
    """The old curve ends one tick before the new one, whose start is marked by a point."""
    recorder.publish(STATE, *(state(tick) for tick in range(30)))
    recorder.publish(PLAN, plan(0.010, count=60))
    recorder.end_batch()
    after = plan(0.040, count=30, goal_id="g2", revises="g1", phase=0.625)
    recorder.publish(PLAN, after)
    recorder.publish(STATE, *(state(tick) for tick in range(30, 100)))
    trace = recorder.read()
    planned = trace.column("/joints/joint_1/position/planned")
    assert np.array_equal(planned.ticks(), [*range(10, 39), *range(40, 70)])
    assert 39 in planned.times["tick"]  # the curve is broken
    positions = np.frombuffer(after.positions).reshape(30, 6)
    assert joints(trace, "/joints/{}/position/corrected").tolist() == [positions[0].tolist()]
    assert trace.column("/joints/joint_1/position/corrected").ticks().tolist() == [40]
    sentences = [text for (text,) in trace.column("/events/goal", "TextLog:text").values]
    assert any("g2 (forehand) accepted, corrects g1 at phase 0.625: starts at 0.040 s" in text for text in sentences)


def test_a_canceled_plan_ends_at_the_present_tick(recorder: RecorderToFile) -> None:
    recorder.publish(STATE, *(state(tick) for tick in range(30)))
    recorder.publish(PLAN, plan(0.010, count=60))
    recorder.publish(ENDED, result("canceled"))
    recorder.end_batch()
    recorder.publish(STATE, *(state(tick) for tick in range(30, 100)))
    planned = recorder.read().column("/joints/joint_1/position/planned")
    assert np.array_equal(planned.ticks(), range(10, 30))
    assert planned.times["tick"][-1] == 30


def test_a_plan_of_an_earlier_run_ends_with_the_run(recorder: RecorderToFile) -> None:
    recorder.publish(STATE, *(state(tick) for tick in range(30)))
    recorder.publish(PLAN, plan(0.010, count=60))
    recorder.end_batch()
    recorder.publish(STATE, *(state(tick, run=RUN + 1) for tick in range(60)))
    assert np.array_equal(recorder.read().column("/joints/joint_1/position/planned").ticks(), range(10, 30))


def test_a_plan_is_written_to_its_end_if_the_next_run_begins_in_the_same_batch(recorder: RecorderToFile) -> None:
    recorder.publish(STATE, *(state(tick) for tick in range(30)))
    recorder.publish(PLAN, plan(0.010, count=40))
    recorder.end_batch()
    recorder.publish(STATE, *(state(tick) for tick in range(30, 90)), *(state(tick, run=RUN + 1) for tick in range(60)))
    planned = recorder.read().column("/joints/joint_1/position/planned")
    assert np.array_equal(planned.ticks(), range(10, 50))
    assert planned.times["tick"][-1] == 50  # the curve is broken


def test_curves_of_two_plans_with_a_pause_in_between_are_not_joined(recorder: RecorderToFile) -> None:
    """Both have ended when the batch is written; during the pause the limits are the robot's."""
    recorder.publish(STATE, *(state(tick) for tick in range(5)))
    recorder.publish(PLAN, plan(0.010, count=20), plan(0.050, count=20, goal_id="g2"))
    recorder.end_batch()
    recorder.publish(STATE, *(state(tick) for tick in range(5, 90)))
    trace = recorder.read()
    planned = trace.column("/joints/joint_1/position/planned")
    assert np.array_equal(planned.ticks(), [*range(10, 30), *range(50, 70)])
    assert [tick for tick, row in zip(planned.times["tick"].tolist(), planned.values, strict=True) if not row] == [
        30,
        70,
    ]
    assert trace.column("/joints/joint_1/position/limits").ticks().tolist() == [0, 10, 30, 50, 70]


def test_a_plan_received_after_its_cancellation_is_not_written(recorder: RecorderToFile) -> None:
    """The planner publishes a plan after its reply, and a client can cancel as soon as it has the reply."""
    recorder.publish(STATE, *(state(tick) for tick in range(5)))
    recorder.publish(ENDED, result("canceled"))
    recorder.end_batch()
    recorder.publish(PLAN, plan(0.002, count=40))
    recorder.end_batch()
    recorder.publish(STATE, *(state(tick) for tick in range(5, 90)))
    planned = recorder.read().column("/joints/joint_1/position/planned")
    assert max(planned.ticks()) <= 5
