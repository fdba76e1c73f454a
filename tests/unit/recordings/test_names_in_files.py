"""Names of columns and units that files of arrays keep in separate fields."""

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
import rerun as rr
from mcap.writer import Writer

from tools.recordings.learning import load
from tools.recordings.readers.ros import NS, _times
from tools.recordings.recording import Unreadable

JOINTS, THEIRS = ("joint_1", "joint_2"), ["joint_2", "joint_1"]
TIMES, THEIR_VALUES = np.arange(12) / 100, np.arange(24.0).reshape(12, 2) / 10
VALUES = THEIR_VALUES[:, ::-1]


@pytest.mark.parametrize("name", ["joint_names", "joint_name", "joints", "name", "labels"])
def test_joint_names_in_an_npz_file_are_read(tmp_path: Path, name: str):
    arrays: dict[str, Any] = {"t": TIMES, "positions": THEIR_VALUES, name: np.array(THEIRS)}
    np.savez(tmp_path / "a.npz", **arrays)
    assert np.array_equal(load(tmp_path / "a.npz", JOINTS).values, VALUES)


def test_names_stored_as_python_objects_are_refused(tmp_path: Path):
    np.savez(tmp_path / "a.npz", t=TIMES, positions=THEIR_VALUES, joint_names=np.array(THEIRS, dtype=object))
    with pytest.raises(Unreadable, match=r"joint_names has Python objects.*np.array\(joint_names, dtype=str\)"):
        load(tmp_path / "a.npz", JOINTS)


@pytest.mark.parametrize("where", ["attribute", "array beside it", "attribute of the file"])
def test_joint_names_in_an_hdf5_file_are_read(tmp_path: Path, where: str):
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["demo/t"], file["demo/qpos"] = TIMES, THEIR_VALUES
        if where == "array beside it":
            file.create_dataset("demo/joint_names", data=THEIRS, dtype=h5py.string_dtype())
        else:
            (file["demo/qpos"] if where == "attribute" else file).attrs["joint_names"] = THEIRS
    assert np.array_equal(load(tmp_path / "a.h5", JOINTS).values, VALUES)


def test_joint_names_with_indices_in_a_lerobot_data_set_are_read(tmp_path: Path):
    state = {"names": dict(zip(THEIRS, (0, 1), strict=True))}
    files = {"info.json": {"codebase_version": "v2.1", "fps": 100, "features": {"observation.state": state}}}
    files["episodes.jsonl"] = {"episode_index": 0, "length": 12}
    for name, content in files.items():
        (tmp_path / "meta").mkdir(exist_ok=True)
        (tmp_path / "meta" / name).write_text(json.dumps(content))
    (tmp_path / "data/chunk-000").mkdir(parents=True)
    columns = {"observation.state": list(THEIR_VALUES), "timestamp": TIMES, "episode_index": [0] * 12}
    pq.write_table(pa.table(columns), tmp_path / "data/chunk-000/episode_000000.parquet")
    assert np.array_equal(load(tmp_path, JOINTS).values, VALUES)
    for fps in (0, -100, None, "fast"):
        (tmp_path / "meta/info.json").write_text(json.dumps(files["info.json"] | {"fps": fps}))
        with pytest.raises(Unreadable, match=f"info.json is {fps!r}; give --rate"):
            load(tmp_path, JOINTS)
        assert np.array_equal(load(tmp_path, JOINTS, rate=100.0).values, VALUES)


def test_the_unit_in_an_arrays_name_is_recognised(tmp_path: Path):
    np.savez(tmp_path / "a.npz", t=TIMES, positions_deg=VALUES)
    assert load(tmp_path / "a.npz", JOINTS).unit == "deg"


@pytest.mark.parametrize(("own", "taken"), [([0, 2, 4], [0, 2, 4]), ([0, 0, 4], [0, 1, 2]), ([3, 0, 4], [0, 1, 2])])
def test_header_stamps_are_used_only_if_all_messages_have_one(own: list[int], taken: list[int]):
    times, notes = _times(np.stack([own, [7, 8, 9]], axis=1) * NS)
    assert (times.tolist(), bool(notes)) == (taken, own != taken)


def log(path: Path, name: str, index: rr.TimeColumn) -> None:
    """Write the positions as scalars on the timeline `index`."""
    stream = rr.RecordingStream("other", recording_id=name)
    stream.save(path)
    for joint, values in zip(JOINTS, VALUES.T, strict=True):
        stream.send_columns(joint, indexes=[index], columns=rr.Scalars.columns(scalars=values))
    stream.disconnect()


def test_the_first_recording_of_a_rerun_file_is_read_and_a_note_says_so(tmp_path: Path):
    times = rr.TimeColumn("t", duration=TIMES)
    for name in "ab":
        log(tmp_path / f"{name}.rrd", name, times)
    merge = [str(Path(sys.executable).with_name("rerun")), "rrd", "merge", "-o", "both.rrd", "a.rrd", "b.rrd"]
    subprocess.run(merge, cwd=tmp_path, check=True, capture_output=True)
    recording = load(tmp_path / "both.rrd", JOINTS)
    assert np.array_equal(recording.values, VALUES)
    assert recording.notes == ("the first of its 2 recordings is read; save the others in files of their own",)


def test_scalars_on_a_timeline_without_times_are_refused(tmp_path: Path):
    log(tmp_path / "a.rrd", "a", rr.TimeColumn("frame", sequence=np.arange(12)))
    with pytest.raises(Unreadable, match=r"without times, on frame; log them with rr\.set_time"):
        load(tmp_path / "a.rrd", JOINTS)


def test_an_mcap_file_of_another_program_is_not_called_damaged(tmp_path: Path):
    with (tmp_path / "a.mcap").open("wb") as file:
        writer = Writer(file)
        writer.start(profile="ros1")
        writer.finish()
    with pytest.raises(Unreadable, match="an MCAP file that ROS 2 did not write"):
        load(tmp_path / "a.mcap", JOINTS)
