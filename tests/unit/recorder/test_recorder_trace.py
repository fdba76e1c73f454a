"""The recorder's messages of arm and controller, written to a trace and read back."""

import random
from pathlib import Path

import msgspec
import numpy as np
import pytest

from protocol import messages as m
from protocol.bus.bus import Bus
from protocol.bus.sessions import open_session
from protocol.topics import BALL, COMMAND, REFUSED, STATE, STATUS, Publication
from services.common.cli import free_endpoint
from services.recorder.blueprint import build_blueprint
from services.recorder.context import Context
from services.recorder.recorder import Recorder, topic_writers
from services.recorder.validation import listen
from services.recorder.writer import TraceWriter
from tests.unit.recorder.recorder_messages import MESSAGES, RUN, VALUES, command, refused, state, status
from tests.unit.recorder.recorder_to_file import CONFIG, LOG, RECORDED, RecorderToFile, joints
from tools.drill.harness.mutations import mutate
from tools.drill.harness.waiting import eventually
from tools.trace_reader import read_trace


def test_every_recorded_topic_has_a_writer(tmp_path: Path) -> None:
    """A topic added to the table without a writer would be lost silently."""
    writer = TraceWriter(build_blueprint(CONFIG, live=False), tmp_path / "trace.rrd", None)
    writers = topic_writers(Context(writer, CONFIG))
    assert set(writers) == set(RECORDED)
    assert next(iter(writers)) == STATE


@pytest.mark.parametrize("topic", RECORDED, ids=lambda topic: topic.key)
def test_mutated_messages_are_refused_or_written(recorder: RecorderToFile, topic: Publication) -> None:
    """Random changes of a valid message, in the current run or a new one, raise no error."""
    rng, body = random.Random(20_26), msgspec.to_builtins(MESSAGES[topic], builtin_types=(bytes,))
    recorder.publish(STATE, state(0))
    for _ in range(20):
        for _ in range(50):
            recorder.publish_bytes(topic, mutate(body, rng))
        recorder.end_batch()


def test_states_read_back_exactly(recorder: RecorderToFile) -> None:
    states = [state(tick, brake=tick > 320) for tick in range(350)]
    states += [state(tick, condition="reflex", reason="joint 4 was pushed") for tick in range(350, 360)]
    for some in (states[:7], states[7:200], states[200:]):
        recorder.publish(STATE, *some, at=1_700_000_000_000_000_123)
        recorder.end_batch()
    trace = recorder.read()
    assert np.array_equal(joints(trace, "/joints/{}/position/measured"), [s.positions for s in states])
    assert np.array_equal(joints(trace, "/joints/{}/velocity/measured"), [s.velocities for s in states])
    assert np.array_equal(trace.scalars("/arm/torques"), [s.torques for s in states])
    assert np.array_equal(trace.scalars("/arm/saturated"), [s.saturated for s in states])
    assert np.array_equal(trace.scalars("/arm/applied_tick"), [s.applied_tick for s in states])
    truths = [s.truth for s in states if s.truth]
    assert np.array_equal(trace.scalars("/arm/true_position"), [truth.positions for truth in truths])
    assert np.array_equal(trace.scalars("/arm/true_velocity"), [truth.velocities for truth in truths])
    times = trace.column("/joints/joint_1/position/measured").times
    assert np.array_equal(times["tick"], range(360))
    assert np.array_equal(times["sim_time"], np.arange(360) * 1_000_000)
    assert set(times["wall"].tolist()) == {1_700_000_000_000_000_123}
    condition = trace.column("/lanes/condition", "StateChange:state")
    assert [(row, tick) for row, tick in zip(condition.values, condition.times["tick"].tolist(), strict=True)] == [
        ([""], 0),
        (["braking"], 321),
        (["reflex"], 350),
    ]
    assert "the arm is reflex: joint 4 was pushed" in trace.texts("/events/controller")


def test_states_without_true_values_have_no_entity_for_them(recorder: RecorderToFile) -> None:
    recorder.publish(STATE, *(state(tick, truth=False) for tick in range(5)))
    assert "/arm/true_position" not in recorder.read().entities


def test_commands_are_written_with_the_error_of_the_state_they_answer(recorder: RecorderToFile) -> None:
    states = [state(tick) for tick in range(300)]
    commands = [command(tick, goal_id="g1" if tick >= 100 else None) for tick in range(300)]
    recorder.publish(STATE, *states[:150])
    recorder.publish(COMMAND, *commands[:140])
    recorder.end_batch()
    recorder.publish(STATE, *states[150:])
    recorder.publish(COMMAND, *commands[140:])
    trace = recorder.read()
    assert np.array_equal(joints(trace, "/joints/{}/position/reference"), [c.positions for c in commands])
    assert np.array_equal(joints(trace, "/joints/{}/velocity/reference"), [c.velocities for c in commands])
    assert np.array_equal(joints(trace, "/joints/{}/acceleration/commanded"), [c.accelerations for c in commands])
    expected = np.array([s.positions for s in states]) - [c.positions for c in commands]
    assert np.array_equal(joints(trace, "/joints/{}/error"), expected)
    assert trace.column("/lanes/goal", "StateChange:state").times["tick"].tolist() == [100]


def test_a_command_without_its_state_has_no_error_and_is_counted(recorder: RecorderToFile) -> None:
    recorder.publish(STATE, state(0), state(2))
    recorder.publish(COMMAND, *(command(tick) for tick in range(3)))
    trace = recorder.read()
    assert trace.column("/joints/joint_1/error").ticks().tolist() == [0, 2]
    assert trace.scalars("/recorder/states_missing").tolist()[-1] == 1
    assert any("1 more states missing" in text for text in trace.texts("/events/recorder"))


def test_errors_are_written_for_a_batch_longer_than_the_history(recorder: RecorderToFile) -> None:
    """After seconds without CPU time the recorder takes all messages in one batch."""
    recorder.publish(STATE, *(state(tick) for tick in range(2500)))
    recorder.publish(COMMAND, *(command(tick) for tick in range(2500)))
    assert len(recorder.read().scalars("/joints/joint_6/error")) == 2500


def test_a_second_run_follows_the_first_in_the_trace(recorder: RecorderToFile) -> None:
    recorder.publish(STATE, *(state(tick) for tick in range(100)))
    recorder.end_batch()
    recorder.publish(STATE, *(state(tick, run=RUN + 1, seed=1) for tick in range(50)))
    recorder.publish(BALL, m.BallState(time=0.01, position=[1.0, 2.0, 3.0], velocity=[0.0] * 3))
    trace = recorder.read()
    times = trace.column("/joints/joint_2/position/measured").times
    assert np.array_equal(times["tick"], range(150))
    assert np.array_equal(times["sim_time"], np.arange(150) * 1_000_000)
    assert trace.column("/ball/position").ticks().tolist() == [110]
    assert trace.column("/runs", "run").values == [[RUN], [RUN + 1]]
    assert trace.column("/runs", "tick_offset").values == [[0], [100]]
    assert trace.column("/runs", "time_offset").values == [[0.0], [0.1]]
    assert "tick 0 is tick 100 of the trace" in trace.texts("/events/run")[1]


def test_status_is_written_as_curves_lanes_and_events(recorder: RecorderToFile) -> None:
    statuses = [
        status(0.000, "holding"),
        status(0.020, "tracking"),
        status(0.040, "tracking", refused=2),
        status(0.060, "fault", "joint_1 is 0.31 rad off"),
    ]
    recorder.publish(STATE, *(state(tick) for tick in range(80)))
    recorder.publish(STATUS, *statuses)
    trace = recorder.read()
    assert trace.scalars("/timing/late_us").tolist() == [[120.5, 400.25, 900.125]] * 4
    assert trace.scalars("/timing/on_time_ratio").tolist() == [0.997] * 4
    assert trace.scalars("/timing/refused").tolist() == [0, 0, 2, 0]
    assert trace.scalars("/timing/error/velocity").tolist() == [VALUES] * 4
    assert trace.column("/timing/missed").ticks().tolist() == [0, 20, 40, 60]
    modes = trace.column("/lanes/mode", "StateChange:state")
    assert modes.values == [["holding"], ["tracking"], ["fault"]]
    assert modes.times["tick"].tolist() == [0, 20, 60]
    published = trace.texts("/events/controller")
    assert any("refused 2 malformed" in text for text in published)
    assert [text for text in published if "late" in text] == ["late: 3 tick(s) without an answer in time"]
    assert any("joint_1 is 0.31 rad off" in text for text in published)


def test_a_message_one_batch_late_is_placed_at_its_own_time(recorder: RecorderToFile) -> None:
    """Its topic is taken before the states, so later states can be in the previous batch."""
    for tick in range(30):
        recorder.publish(STATE, state(tick), at=100 + tick)
    recorder.end_batch()
    recorder.publish(REFUSED, refused(), at=104)
    recorder.publish(STATE, state(30), at=130)
    assert recorder.read().column("/goals/refused", "code").times["tick"].tolist() == [4]


def test_malformed_messages_are_counted_and_the_others_written(
    recorder: RecorderToFile, caplog: pytest.LogCaptureFixture
) -> None:
    for topic in RECORDED:
        recorder.publish_bytes(topic, b"\xc1")
        recorder.publish(topic, MESSAGES[topic])
    trace = recorder.read()
    assert trace.scalars("/recorder/messages_malformed").tolist() == [len(RECORDED)]
    refused = [each for each in caplog.records if "was left out" in each.getMessage()]
    assert [each.__dict__["code"] for each in refused] == ["bad_message"] * len(RECORDED)
    assert trace.scalars("/joints/joint_1/position/measured").tolist() == [state(3).positions[0]]


def test_nothing_is_lost_from_a_real_bus(tmp_path: Path) -> None:
    endpoint, file = free_endpoint(), tmp_path / "trace.rrd"
    writer = TraceWriter(build_blueprint(CONFIG, live=False), file, None)
    with Bus(open_session(listen=[endpoint])) as router, Bus(open_session(connect=[endpoint])) as bus:
        sources = listen(bus)
        recorder = Recorder(CONFIG, writer, sources, LOG)
        router.announce("ready")
        assert bus.is_alive("ready")  # earlier subscriptions have then reached the router
        states, commands = router.publisher(STATE, blocking=True), router.publisher(COMMAND, blocking=True)
        others = [(router.publisher(topic), topic) for topic in RECORDED if not topic.stream]
        for tick in range(1000):
            states.put(state(tick))
            commands.put(command(tick))
            if tick == 500:
                for publisher, topic in others:
                    publisher.put(MESSAGES[topic])
            if tick % 300 == 0:
                recorder.write_batch()
        runs = recorder.runs
        assert eventually(lambda: recorder.write_batch() or runs.present.newest == runs.present.answered == 999)
    writer.close()
    trace = read_trace(file)
    expected = [state(tick).positions for tick in range(1000)]
    assert np.array_equal(joints(trace, "/joints/{}/position/measured"), expected)
    assert len(trace.scalars("/joints/joint_1/error")) == 1000
    assert trace.scalars("/contacts").tolist() == [0.42]
    assert trace.scalars("/recorder/states_missing").tolist() == [0]
