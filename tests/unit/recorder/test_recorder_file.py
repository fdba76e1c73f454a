"""The trace as a file: its index, an incomplete end, an absent directory, static data."""

import logging
import threading
from pathlib import Path

import numpy as np
import pytest
from rerun.chunk import RrdReader

from protocol.topics import BALL, STATE
from robot.description import load_robot
from services.recorder import entities
from services.recorder.__main__ import main
from services.recorder.blueprint import build_blueprint
from services.recorder.geometry import Geometry
from services.recorder.scene import Scene
from services.recorder.writer import Rows, TraceWriter
from tests.unit.recorder.recorder_messages import JOINTS, MESSAGES, state
from tests.unit.recorder.recorder_to_file import CONFIG, RecorderToFile
from tools.trace_reader import read_trace

PLAIN = [entity for entity in entities.ENTITIES if "BODY" not in entity.path and "PART" not in entity.path]


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
