"""The recorder's trace, written to a file and read back."""

import logging
import random
import threading
from collections.abc import Iterator
from pathlib import Path

import msgspec
import numpy as np
import pytest
import rerun as rr
from rerun.chunk import RrdReader

from protocol import messages as m
from protocol.bus.bus import Bus
from protocol.bus.sessions import open_session
from protocol.codec import encode
from protocol.topics import (
    BALL,
    COMMAND,
    CONTACT,
    DISTURBANCE,
    ENDED,
    PLAN,
    PUBLICATIONS,
    REFUSED,
    STATE,
    STATUS,
    Publication,
)
from robot.description import load_robot
from robot.kinematics import Kinematics
from services.common.cli import free_endpoint
from services.recorder import entities
from services.recorder.__main__ import main
from services.recorder.blueprint import build_blueprint
from services.recorder.context import Context
from services.recorder.geometry import Geometry
from services.recorder.recorder import Recorder, topic_writers
from services.recorder.scene import Scene
from services.recorder.validation import listen
from services.recorder.writer import Rows, TraceWriter
from tests.unit.recorder.recorder_messages import (
    JOINTS,
    MESSAGES,
    RUN,
    VALUES,
    FakeStream,
    command,
    plan,
    push,
    refused,
    result,
    state,
    status,
)
from tests.waiting import eventually
from tools.drill.harness.mutations import mutate
from tools.trace_reader import Trace, read_trace

RECORDED = tuple(topic for topic in PUBLICATIONS if topic.recorded)
CONFIG = load_robot()
PLAIN = [entity for entity in entities.ENTITIES if "BODY" not in entity.path and "PART" not in entity.path]
LOG = logging.getLogger("test")


@pytest.fixture(autouse=True)
def strict() -> Iterator[None]:
    """Misuse of Rerun raises instead of being logged."""
    rr.set_strict_mode(True)
    yield
    rr.set_strict_mode(False)


class RecorderToFile:
    """A recorder with fake subscriptions that writes into a file."""

    def __init__(self, file: Path) -> None:
        self._file = file
        self._writer = TraceWriter(build_blueprint(CONFIG, live=False), file, None)
        self._sources = {topic: FakeStream() for topic in RECORDED}
        self._recorder = Recorder(CONFIG, self._writer, self._sources, LOG)

    def publish(self, topic: Publication, *messages: m.Message, at: int = 1) -> None:
        """Publish messages, received at `at` Unix ns."""
        self._sources[topic].extend((encode(message), at) for message in messages)

    def publish_bytes(self, topic: Publication, body: bytes) -> None:
        """Publish a body of any bytes."""
        self._sources[topic].append((body, 1))

    def end_batch(self) -> None:
        """Write the messages published since the last batch."""
        self._recorder.write_batch()

    def read(self) -> Trace:
        """End the last batch and the trace, and read it back."""
        self.end_batch()
        self._writer.close()
        return read_trace(self._file)


@pytest.fixture
def recorder(tmp_path: Path) -> RecorderToFile:
    return RecorderToFile(tmp_path / "trace.rrd")


def _joints(trace: Trace, path: str) -> np.ndarray:
    """Return the scalars (N, J) of an entity that exists for each joint."""
    return np.stack([trace.scalars(path.format(name)) for name in JOINTS], axis=1)


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
    for _ in range(100):
        for _ in range(50):
            recorder.publish_bytes(topic, mutate(body, rng))
        recorder.end_batch()


@pytest.mark.filterwarnings("ignore:RRD file has no footer")
@pytest.mark.parametrize("index", [True, False])
def test_a_trace_reads_the_same_with_and_without_its_index(tmp_path: Path, index: bool) -> None:
    file = tmp_path / "trace.rrd"
    writer = TraceWriter(build_blueprint(CONFIG, live=False), file, None, index)
    values = np.arange(1000.0)
    for first in range(0, 1000, 10):
        writer.scalars("/x", Rows(np.arange(first, first + 10), 1000.0), values[first : first + 10])
        writer.recording.flush()
    writer.close()
    assert np.array_equal(read_trace(file).scalars("/x").ravel(), values)
    assert (b"FOOT" in file.read_bytes()[-64:]) is index


@pytest.mark.parametrize("beyond", [0, 7, 16, 100])
def test_a_trace_reads_up_to_an_incomplete_last_message(tmp_path: Path, beyond: int) -> None:
    """The file has nothing of it, a part of its header, its header, or a part of its data."""
    file = tmp_path / "trace.rrd"
    writer = TraceWriter(build_blueprint(CONFIG, live=False), file, None, False)
    lengths = []
    for first in range(0, 30, 10):
        writer.scalars("/x", Rows(np.arange(first, first + 10), 1000.0), np.arange(first, first + 10.0))
        writer.recording.flush()
        lengths.append(file.stat().st_size)
    writer.close()
    file.write_bytes(file.read_bytes()[: lengths[1] + beyond])
    assert np.array_equal(read_trace(file).scalars("/x").ravel(), np.arange(20.0))


def test_states_read_back_exactly(recorder: RecorderToFile) -> None:
    states = [state(tick, brake=tick > 320) for tick in range(350)]
    states += [state(tick, condition="reflex", reason="joint 4 was pushed") for tick in range(350, 360)]
    for some in (states[:7], states[7:200], states[200:]):
        recorder.publish(STATE, *some, at=1_700_000_000_000_000_123)
        recorder.end_batch()
    trace = recorder.read()
    assert np.array_equal(_joints(trace, "/joints/{}/position/measured"), [s.positions for s in states])
    assert np.array_equal(_joints(trace, "/joints/{}/velocity/measured"), [s.velocities for s in states])
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


def test_static_data_are_styles_of_the_table_and_geometry_of_the_model(tmp_path: Path) -> None:
    recorder = RecorderToFile(tmp_path / "trace.rrd")
    recorder.publish(STATE, state(0))
    recorder.publish(BALL, MESSAGES[BALL])
    recorder.read()
    scene, geometry_of = Scene(CONFIG), Geometry(CONFIG.load_model(visual=True), np.zeros(3), 1.0)
    bodies = {name: [part for part, _ in geometry_of.shapes(body)] for body, name in enumerate(scene.names)}
    geometry = {entities.SHAPE.at(name, part) for name, parts in bodies.items() if name != "world" for part in parts}
    geometry |= {entities.WORLD_SHAPE.at(part) for part in bodies["world"]}
    styled = {entity.at(*([name] if "JOINT" in entity.path else [])) for entity in PLAIN for name in JOINTS}
    static = {chunk.entity_path for chunk in RrdReader(tmp_path / "trace.rrd").stream() if chunk.is_static}
    assert geometry <= static
    fixed = {entities.FIXED_BODY.at("base")}
    assert static - geometry - styled == {"/__properties", *fixed}


def test_commands_are_written_with_the_error_of_the_state_they_answer(recorder: RecorderToFile) -> None:
    states = [state(tick) for tick in range(300)]
    commands = [command(tick, goal_id="g1" if tick >= 100 else None) for tick in range(300)]
    recorder.publish(STATE, *states[:150])
    recorder.publish(COMMAND, *commands[:140])
    recorder.end_batch()
    recorder.publish(STATE, *states[150:])
    recorder.publish(COMMAND, *commands[140:])
    trace = recorder.read()
    assert np.array_equal(_joints(trace, "/joints/{}/position/reference"), [c.positions for c in commands])
    assert np.array_equal(_joints(trace, "/joints/{}/velocity/reference"), [c.velocities for c in commands])
    assert np.array_equal(_joints(trace, "/joints/{}/acceleration/commanded"), [c.accelerations for c in commands])
    expected = np.array([s.positions for s in states]) - [c.positions for c in commands]
    assert np.array_equal(_joints(trace, "/joints/{}/error"), expected)
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


def test_a_trace_in_an_absent_directory_is_refused_in_a_sentence(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    file = tmp_path / "absent" / "trace.rrd"
    monkeypatch.setattr("sys.argv", ["recorder", "--record", str(file)])
    start = logging.getLogger(), threading.Event(), load_robot()
    monkeypatch.setattr("services.recorder.__main__.start_beside_loops", lambda *_: start)
    with pytest.raises(SystemExit) as stopped:
        main()
    assert (stopped.value.code, caplog.messages) == (2, [f"--record {file}: there is no directory {file.parent}"])


def test_a_plan_is_written_as_time_passes_and_reads_back(recorder: RecorderToFile) -> None:
    published = plan(0.010, count=40)
    recorder.publish(STATE, *(state(tick) for tick in range(20)))
    recorder.publish(PLAN, published)
    recorder.end_batch()
    recorder.publish(STATE, *(state(tick) for tick in range(20, 90)))
    trace = recorder.read()
    positions = np.frombuffer(published.positions).reshape(40, 6)
    assert np.array_equal(_joints(trace, "/joints/{}/position/planned"), positions)
    assert np.array_equal(
        _joints(trace, "/joints/{}/velocity/planned"), np.frombuffer(published.velocities).reshape(40, 6)
    )
    accelerations = np.frombuffer(published.accelerations).reshape(40, 6)
    assert np.array_equal(_joints(trace, "/joints/{}/acceleration/planned"), accelerations)
    assert np.array_equal(_joints(trace, "/joints/{}/position/demonstrated"), positions[:39] / 2)
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
    assert _joints(trace, "/joints/{}/position/corrected").tolist() == [positions[0].tolist()]
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


def test_a_result_is_written_with_its_event(recorder: RecorderToFile) -> None:
    recorder.publish(STATE, *(state(tick) for tick in range(10)))
    recorder.publish(ENDED, result("aborted", reason="fault"))
    trace = recorder.read()
    assert trace.column("/goals", "outcome").values == [["aborted"]]
    assert trace.column("/goals", "accepted").values == [[RUN + 2]]
    assert trace.column("/goals", "peak_tracking_error").values == [[0.0625]]
    assert trace.scalars("/goals/position_error").tolist() == [VALUES]
    assert trace.column("/goals/velocity_error").ticks().tolist() == [2]
    assert "goal g1 aborted (fault)" in trace.texts("/events/goal")[0]


def test_a_refused_goal_is_a_warning_at_the_arms_tick(recorder: RecorderToFile) -> None:
    """With its id if it has one, among the events of other goals."""
    for tick in range(10):
        recorder.publish(STATE, state(tick), at=100 + tick)
    recorder.publish(REFUSED, refused(), at=104)
    recorder.publish(REFUSED, refused(goal_id=None), at=107)
    trace = recorder.read()
    why = "refused as limit: joint_1 would end at 2.5 rad"
    assert trace.texts("/events/goal") == [f"goal g2 {why}", f"a goal {why}"]
    assert trace.column("/events/goal", "TextLog:text").times["tick"].tolist() == [4, 7]
    assert trace.column("/events/goal", "TextLog:level").values == [["WARN"]] * 2
    wanted = {
        "goal_id": ["g2", ""],
        "client_id": ["shell-1"] * 2,
        "primitive": ["forehand"] * 2,
        "code": ["limit"] * 2,
        "requested": [RUN] * 2,
    }
    for name, values in wanted.items():
        assert trace.column("/goals/refused", name).values == [[value] for value in values], name


def test_a_message_one_batch_late_is_placed_at_its_own_time(recorder: RecorderToFile) -> None:
    """Its topic is taken before the states, so later states can be in the previous batch."""
    for tick in range(30):
        recorder.publish(STATE, state(tick), at=100 + tick)
    recorder.end_batch()
    recorder.publish(REFUSED, refused(), at=104)
    recorder.publish(STATE, state(30), at=130)
    assert recorder.read().column("/goals/refused", "code").times["tick"].tolist() == [4]


def test_contacts_and_ball_positions_are_written(recorder: RecorderToFile) -> None:
    places = [[0.1 * k, 1 / 3, -0.7] for k in range(5)]
    recorder.publish(STATE, *(state(tick) for tick in range(50)))
    touch = m.Contact(time=0.012, bodies=["racket", "ball"], impulse=0.02, ball_velocity=None, ended=False)
    recorder.publish(
        CONTACT, touch, msgspec.structs.replace(touch, impulse=0.42, ball_velocity=[3.0, 0.0, 4.0], ended=True)
    )
    recorder.publish(
        BALL, *(m.BallState(time=k / 100, position=place, velocity=[0.0] * 3) for k, place in enumerate(places))
    )
    trace = recorder.read()
    assert trace.scalars("/contacts").tolist() == [0.42]
    assert trace.column("/contacts").ticks().tolist() == [12]
    assert trace.texts("/events/contact") == [
        "racket and ball touch",
        "racket and ball parted after 0.420 N·s, the ball leaves at 5.00 m/s",
    ]
    assert trace.scalars("/ball/position").tolist() == places
    tee = np.array(trace.column("/world/tee", "Transform3D:translation").values)
    assert tee.reshape(-1) == pytest.approx([0.0, 1 / 3, -0.733], abs=1e-6)


def test_disturbances_are_written_as_steps_lanes_and_arrows(recorder: RecorderToFile) -> None:
    recorder.publish(STATE, *(state(tick) for tick in range(50)))
    recorder.publish(
        DISTURBANCE, push(0.010, acceleration=[30.0, 0, 0, 0, 0, 0], torque=[0, -2.0, 0, 0, 0, 0]), push(0.030)
    )
    trace = recorder.read()
    steps = trace.column("/joints/joint_1/disturbance/acceleration")
    assert list(zip(steps.ticks().tolist(), steps.array().tolist(), strict=True)) == [
        (9, 0.0),
        (10, 30.0),
        (29, 30.0),
        (30, 0.0),
    ]
    assert trace.scalars("/joints/joint_2/disturbance/torque").tolist() == [0.0, -2.0, -2.0, 0.0]
    lane = trace.column("/lanes/disturbance", "StateChange:state")
    assert lane.values == [["acceleration + torque"], [""]]
    arrows = trace.column("/world/shoulder/push", "Arrows3D:vectors")
    assert [len(row) for row in arrows.values] == [1, 0]
    assert [len(row) for row in trace.column("/world/upper_arm/push", "Arrows3D:vectors").values] == [1, 0]


def test_the_rackets_pose_agrees_with_the_kinematics(recorder: RecorderToFile) -> None:
    """Quaternions are in Rerun's order; the tool is fixed relative to the racket."""
    states = [state(tick) for tick in range(60)]
    recorder.publish(STATE, *states)
    trace = recorder.read()
    places = trace.column("/world/racket", "Transform3D:translation")
    turns = trace.column("/world/racket", "Transform3D:quaternion")
    assert places.times["tick"].tolist() == [0, 10, 20, 30, 40, 50]
    kinematics = Kinematics(CONFIG)
    for tick, place, turn in zip(places.times["tick"].tolist(), places.values, turns.values, strict=True):
        x, y, z, w = turn[0]
        local = np.array([0.0, 0.0, 0.39])  # the tool's site in the racket's frame
        vector = np.array([x, y, z])
        turned = local + 2 * np.cross(vector, np.cross(vector, local) + w * local)
        tool, _ = kinematics.tool_pose(np.array(states[tick].positions))
        assert np.array(place[0]) + turned == pytest.approx(tool, abs=1e-5)


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
    assert np.array_equal(_joints(trace, "/joints/{}/position/measured"), expected)
    assert len(trace.scalars("/joints/joint_1/error")) == 1000
    assert trace.scalars("/contacts").tolist() == [0.42]
    assert trace.scalars("/recorder/states_missing").tolist() == [0]
