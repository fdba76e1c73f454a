"""The recorder's .rrd file, read back and compared with what was published on the bus."""

from collections.abc import Container
from dataclasses import dataclass

import numpy as np
import pytest
from harness import SERVICES, Stack, running

from deploy.demonstrations.make_forehand import HIT
from protocol import messages as m
from protocol import topics
from protocol.codec import matrix
from robot.conversions import samples_of
from robot.description import load_robot
from services.recorder import entities
from services.recorder.entities import ENTITIES, Entity, Event
from services.recorder.scene import Scene
from tools.demo.strikes import goal
from tools.trace_reader import Trace, read_trace

NAMES = load_robot().joint_names
PLAYED: set[Event] = {"", "known truth", "a ball", "a plan", "a goal", "a result", "a hit"}
"""The log events of a run with a goal."""


@dataclass(frozen=True, slots=True)
class Strike:
    """The messages published in one run, the goal's result, and which goal was refused at which tick."""

    states: list[m.State]
    commands: list[m.Command]
    plan: m.Plan
    result: m.Result
    refused: m.Refused
    refused_at: int


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> tuple[list[Strike], Trace]:
    """Play two runs beside a recorder and end it; each run has its own start, a push and a refused goal."""
    directory = tmp_path_factory.mktemp("trace")
    file = directory / "strikes.rrd"
    with running(directory, names=(*SERVICES, "recorder"), record=file) as stack:
        strikes = [play(stack, 0.0), play(stack, 0.1)]
    return strikes, read_trace(file)


def play(stack: Stack, shift: float) -> Strike:
    """Strike once, starting `shift` rad from home, with a push; at its start, send a goal that is refused as late."""
    home = load_robot().home + shift
    stack.reset(positions=home.tolist())
    push = [20.0, 0.0, 0.0, 0.0, 0.0, 0.0]
    stack.bus.ask(topics.SIM_DISTURB, m.Disturb(kind="acceleration", values=push, start_time=0.2, duration=0.1))
    reply = stack.bus.ask(topics.GOAL, goal())
    stack.step_to(stack.ticks(reply.start_time))
    stack.listen(topics.REFUSED)
    stack.refused_goal(goal_id="too-late", client_id="shell", arrival_time=reply.start_time)
    refused, refused_at = stack.next(topics.REFUSED), stack.tick
    plan, result = stack.plan_of(reply), stack.finish(reply)
    stack.step(20)
    return Strike(stack.states(), stack.commands(), plan, result, refused, refused_at)


def rows(trace: Trace, entity: str, strikes: list[Strike], run: int) -> np.ndarray:
    """Return the numbers of an entity with one row per tick, over one of the runs."""
    lengths = [len(one.states) for one in strikes]
    values = trace.scalars(entity)[-sum(lengths) :]
    first = sum(lengths[:run])
    return values[first : first + lengths[run]]


@pytest.mark.parametrize("run", [0, 1])
def test_the_trace_has_the_numbers_of_the_states(recorded: tuple[list[Strike], Trace], run: int):
    strikes, trace = recorded
    states = strikes[run].states
    for quantity, field in (("position", "positions"), ("velocity", "velocities")):
        for joint, name in enumerate(NAMES):
            seen = rows(trace, f"/joints/{name}/{quantity}/measured", strikes, run)
            assert np.array_equal(seen.ravel(), [getattr(state, field)[joint] for state in states]), (quantity, name)
    assert np.array_equal(rows(trace, "/arm/torques", strikes, run), [state.torques for state in states])
    truths = [state.truth.positions for state in states if state.truth]
    assert np.array_equal(rows(trace, "/arm/true_position", strikes, run), truths)


@pytest.mark.parametrize("run", [0, 1])
def test_the_trace_has_the_numbers_of_the_commands(recorded: tuple[list[Strike], Trace], run: int):
    strikes, trace = recorded
    commands = strikes[run].commands
    curves = (("position/reference", "positions"), ("velocity/reference", "velocities"))
    for curve, field in (*curves, ("acceleration/commanded", "accelerations")):
        for joint, name in enumerate(NAMES):
            seen = rows(trace, f"/joints/{name}/{curve}", strikes, run)
            assert np.array_equal(seen.ravel(), [getattr(command, field)[joint] for command in commands]), (curve, name)


def test_every_tick_is_in_the_trace_once_and_in_order(recorded: tuple[list[Strike], Trace]):
    strikes, trace = recorded
    for curve in ("position/measured", "position/reference"):
        ticks = trace.column(f"/joints/{NAMES[0]}/{curve}").ticks()[-sum(len(one.states) for one in strikes) :]
        assert np.array_equal(np.diff(ticks), np.ones(len(ticks) - 1)), curve


def test_the_trace_has_the_plan_and_the_result(recorded: tuple[list[Strike], Trace]):
    strikes, trace = recorded
    for one, errors in zip(strikes, trace.scalars("/goals/position_error"), strict=True):
        assert one.result.outcome == "succeeded"
        assert one.result.hit
        assert errors.tolist() == one.result.hit.position_error
    wanted = np.concatenate([samples_of(one.plan).positions[:, 0] for one in strikes])
    planned = trace.scalars(f"/joints/{NAMES[0]}/position/planned").ravel()
    assert set(planned) <= set(wanted)
    assert planned.max() == pytest.approx(wanted.max(), abs=1e-3)  # not every sample is drawn


def test_the_push_is_an_event_and_an_arrow_on_its_link(recorded: tuple[list[Strike], Trace]):
    strikes, trace = recorded
    events = [text for text in trace.texts("/events/disturbance") if "no disturbance" not in text]
    assert len(events) == len(strikes)
    [pushed] = [entity for entity in trace.entities if entity.endswith("/push")]
    drawn = [len(row) for row in trace.column(pushed, "Arrows3D:vectors").values]
    assert drawn == [1, 0] * len(strikes)  # the arrow appears and disappears with the push


def test_a_refused_goal_is_on_the_timeline_with_its_code(recorded: tuple[list[Strike], Trace]):
    strikes, trace = recorded
    events = [f"goal too-late refused as late: {one.refused.message}" for one in strikes]
    assert [text for text in trace.texts("/events/goal") if " refused as " in text] == events
    for name, value in {"goal_id": "too-late", "client_id": "shell", "code": "late"}.items():
        assert trace.column("/goals/refused", name).values == [[value]] * len(strikes), name
    offsets = [offset for [offset] in trace.column("/runs", "tick_offset").values[-len(strikes) :]]
    at = [offset + one.refused_at for offset, one in zip(offsets, strikes, strict=True)]
    late = trace.column("/goals/refused", "code").times["tick"] - at
    assert not late.any()


# --- the table of entities ---------------------------------------------------------------------------------


def paths(entity: Entity) -> set[str]:
    """Return the paths of an entity: of every joint, of every body of the arm, or of the link that is pushed."""
    scene, home = Scene(load_robot()), load_robot().home
    if entity is entities.PUSH_ARROW:
        return {entity.at(scene.push_arrow(0, home)[0])}
    if "JOINT" in entity.path:
        return {entity.at(name) for name in NAMES}
    bodies = [*scene.arm, *scene.others]
    return {entity.at(scene.names[body]) for body in bodies} if "BODY" in entity.path else {entity.path}


def check_table(trace: Trace, occurred: Container[Event]) -> None:
    """Check that the trace has exactly the table's entities, each with components of its archetype."""
    written = {entity for entity in ENTITIES if not entity.static and entity.needs in occurred}
    assert set(trace.entities) == set().union(*map(paths, written))
    for entity in written:
        for path in paths(entity):
            components = trace.components(path)
            if entity.archetype == entities.VALUES:
                assert set(components) <= set(entity.shows.replace(",", "").split("`")), path
            else:
                assert {component.partition(":")[0] for component in components} == {entity.archetype}, path


def test_a_trace_of_strikes_has_the_entities_of_the_table(recorded: tuple[list[Strike], Trace]):
    """The trace has exactly the table's entities, those of contacts, pushes and refusals included."""
    check_table(recorded[1], PLAYED | {"a contact", "a disturbance", "a push", "a refusal"})


# --- a corrected swing ------------------------------------------------------------------------------------

PARTS = 0.4, 0.7, 0.85
"""Where corrections begin, as parts of the way to the hit."""


@dataclass(frozen=True, slots=True)
class Corrected:
    """A swing and its corrections: the published plans and the trace."""

    plans: list[m.Plan]
    trace: Trace

    def first_tick(self, index: int) -> int:
        """Return the tick at which a plan begins; ticks of the first run of a trace are the robot's own."""
        return round(self.plans[index].start_time * 1000)


@pytest.fixture(scope="module")
def corrected(tmp_path_factory: pytest.TempPathFactory) -> Corrected:
    """Record a swing that is corrected three times; the target moves by 0.03 rad each time."""
    directory = tmp_path_factory.mktemp("corrected")
    file = directory / "corrected.rrd"
    with running(directory, names=(*SERVICES, "recorder"), record=file) as stack:
        stack.reset()
        swing = stack.strike(goal_id="swing")
        last, plans = swing, [stack.plan_of(swing)]
        for index, part in enumerate(PARTS):
            stack.step_to(stack.ticks(swing.start_time + part * swing.duration) - 20)
            moved = [place + 0.03 * (index + 1) for place in HIT]
            last = stack.strike(revises="swing", goal_id=f"correction {index + 1}", positions=moved)
            plans.append(stack.plan_of(last))
        assert stack.finish(last).outcome == "succeeded"
        stack.step(20)
    return Corrected(plans, read_trace(file))


def test_where_a_correction_begins_the_curves_before_end(corrected: Corrected):
    """A correction breaks the curves: the old part ends one tick before the new one, so no line joins them."""
    begins = [corrected.first_tick(index) for index in range(len(corrected.plans))]
    for joint, name in enumerate(NAMES):
        column = corrected.trace.column(f"/joints/{name}/position/planned")
        drawn = dict(zip(column.ticks().tolist(), column.array().tolist(), strict=True))
        for index, plan in enumerate(corrected.plans):
            end = begins[index + 1] - 1 if index < len(PARTS) else begins[index] + plan.hit_index + 1
            positions = samples_of(plan).positions[:, joint]
            ticks = range(begins[index], end)
            assert [drawn[tick] for tick in ticks] == positions[: len(ticks)].tolist(), (name, index)
        gaps = [begin - 1 for begin in begins[1:]]
        assert not set(gaps) & set(drawn)
        assert set(gaps) <= set(column.times["tick"].tolist())  # the curves are broken there


def test_a_trace_of_corrections_has_the_entities_of_the_table(corrected: Corrected):
    """The trace has exactly the entities of the table."""
    check_table(corrected.trace, PLAYED | {"a correction"})


def test_the_point_where_a_correction_begins_is_marked(corrected: Corrected):
    """Every joint's curve has a point there."""
    begins = [corrected.first_tick(index) for index in range(1, len(corrected.plans))]
    for joint, name in enumerate(NAMES):
        column = corrected.trace.column(f"/joints/{name}/position/corrected")
        assert column.ticks().tolist() == begins
        assert column.array().tolist() == [samples_of(plan).positions[0, joint] for plan in corrected.plans[1:]]


def test_the_trace_names_the_corrected_goal_and_the_phase(corrected: Corrected):
    """The phase is recorded as a number; the event names the corrected goal."""
    phases = [phase for [phase] in corrected.trace.column("/plans", "phase").values]
    assert phases == pytest.approx([0.0, *PARTS], abs=1e-9)
    assert phases == [plan.phase for plan in corrected.plans]
    assert corrected.trace.column("/plans", "revises").values == [[""], *[["swing"]] * len(PARTS)]
    events = corrected.trace.texts("/events/goal")
    for index, part in enumerate(PARTS):
        name = f"plan correction {index + 1} (forehand) accepted, corrects swing at phase {part:.3f}"
        assert any(text.startswith(name) for text in events), events


def test_the_rest_of_the_demonstration_is_drawn_beside_a_correction(corrected: Corrected):
    """The demonstration is drawn from the phase at which the correction begins."""
    for joint, name in enumerate(NAMES):
        column = corrected.trace.column(f"/joints/{name}/position/demonstrated")
        drawn = dict(zip(column.ticks().tolist(), column.array().tolist(), strict=True))
        last, begin = corrected.plans[-1], corrected.first_tick(-1)
        shown = matrix(last.demonstration, last.hit_index + 1, len(NAMES), "demonstration")[:, joint]
        assert [drawn[begin + k] for k in range(len(shown))] == shown.tolist()
