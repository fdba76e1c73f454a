"""A UR5e over the bus: a plan that would collide is refused; played without the check, the arm stops pressing."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from protocol import messages as m
from protocol import topics
from protocol.errors import Refusal
from robot.conversions import samples_of
from services.common.cli import Options
from tests import arms, models
from tests.cores import LOOP_CORE
from tools.drill.harness.cell import Cell
from tools.drill.harness.start import CellConfig, start_cell
from tools.drill.scenarios.pushes import UNLOAD_S, torque_left

TABLE = """
<mujoco>
  <include file="ur5e.xml"/>
  <worldbody><body name="table" pos="0 0.45 0.1"><geom type="box" size="0.3 0.3 0.02"/></body></worldbody>
</mujoco>
"""
PRESSES = 0.1
"""Largest torque besides gravity's from 100 ms after a fault, as a fraction of its limit."""
OFF = 2e-3
"""An arm that touches nothing stays within this distance of its plan, rad."""


def learn_wave(cell: Cell) -> None:
    """Learn a small movement of all joints."""
    times = np.linspace(0, 1, 201)
    shape = times**3 * (10 - 15 * times + 6 * times**2)
    movement = cell.config.home + np.outer(shape, [0.2, 0.1, 0.1, 0.1, 0.1, 0.1])
    cell.bus.ask(topics.LEARN, m.Learn(name="wave", times=(2 * times).tolist(), positions=movement.tolist()))


def test_a_folding_arm_is_refused_and_would_have_touched_itself(tmp_path: Path):
    """The arm leaves its plan shortly after the refusal's instant, which is when the bodies are a margin apart."""
    config = CellConfig(robot_config=arms.UR5E.write(tmp_path, "ur5e"))
    with start_cell(config, Options(loop_core=LOOP_CORE), tmp_path) as cell:
        learn_wave(cell)
        folded = [*cell.home[:2], 3.1, *cell.home[3:]]
        with pytest.raises(Refusal) as caught:
            cell.goal(primitive="wave", positions=folded)
        refusal = caught.value
        found = refusal.detail
        assert (refusal.code, found["body"], found["other"]) == ("collision", "wrist_3_link", "upper_arm_link")
        safe = cell.goal(primitive="wave", plan_only=True).report
        assert safe.checked == "all"
        assert safe.clearance is not None
        assert safe.torque_use is not None
        cell.reset()
        reply = cell.goal(primitive="wave", positions=folded, checks=m.Checks(collision=False), include_trajectory=True)
        assert (reply.report.clearance, reply.report.certified) == (None, True)
        cell.step(cell.ticks(reply.start_time + reply.total_duration))
        assert reply.trajectory is not None
        planned = samples_of(reply.trajectory).positions
        measured = np.array([state.positions for state in cell.states()])[cell.ticks(reply.start_time) :]
        count = min(len(planned), len(measured))
        off = np.abs(planned[:count] - measured[:count]).max(axis=1)
        touched = np.flatnonzero(off > OFF)[0] / cell.config.rate_hz
        assert 0 < touched - found["time_from_start"] < 0.1


@pytest.mark.parametrize(
    ("model", "end", "body"),
    [
        (models.UR5E.name, (-1.57, -1.57, 3.1, -1.57, -1.57, 0.0), "upper_arm_link"),
        ("cell.xml", (-1.57, -0.57, 1.57, -1.57, -1.57, 0.0), "table"),
    ],
)
def test_an_arm_that_meets_itself_or_a_table_stops_pressing(
    tmp_path: Path, model: str, end: tuple[float, ...], body: str
):
    for file in models.UR5E.parent.iterdir():
        (tmp_path / file.name).symlink_to(file)
    (tmp_path / "cell.xml").write_text(TABLE)
    description = replace(arms.UR5E, model=tmp_path / model).write(tmp_path)
    description.write_text(description.read_text().replace("max_tracking_error = 0.3", "max_tracking_error = 0.1"))
    with start_cell(CellConfig(robot_config=description), Options(loop_core=LOOP_CORE), tmp_path) as cell:
        learn_wave(cell)
        cell.reset()
        reply = cell.goal(primitive="wave", positions=list(end), checks=m.Checks(collision=False, torque=False))
        cell.step(cell.ticks(reply.start_time + reply.total_duration + 0.5))
        result = cell.result(reply.goal_id)
        assert result.outcome == "aborted"
        assert result.first_contact is not None
        assert body in (result.first_contact.body, result.first_contact.other)
        assert torque_left(cell, reply, cell.ticks(UNLOAD_S)) < PRESSES
