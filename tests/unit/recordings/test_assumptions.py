"""What a reader assumes about a recording is printed, and what is missing is named: column, samples and times."""

from pathlib import Path

import h5py
import numpy as np
import pytest
from rosbags.rosbag2 import Writer as BagWriter
from rosbags.typesys import Stores, get_typestore

from tests.unit.recordings import writers
from tools.recordings import readers
from tools.recordings.learning import load
from tools.recordings.recording import Recording, Unreadable
from tools.recordings.writers import write

TIMES, JOINTS = writers.TIMES, writers.JOINTS
TWO = "joint_1", "joint_2"


def array(tmp_path: Path, times: np.ndarray = TIMES, **arrays: np.ndarray) -> Path:
    path = tmp_path / "demo.npz"
    np.savez(path, allow_pickle=False, t=times, joint_names=np.array(JOINTS), **arrays)
    return path


def without(joint: int, rows: slice) -> np.ndarray:
    """The movement without the numbers of a joint in some samples."""
    values = writers.movement()
    values[rows, joint] = np.nan
    return values


def refusal(path: Path, joints=JOINTS, **options) -> str:
    with pytest.raises(Unreadable) as caught:
        load(path, joints, **options)
    return str(caught.value)


@pytest.mark.parametrize("kind", ["csv", "npy"])
def test_a_first_column_taken_as_the_time_is_named(tmp_path: Path, kind: str) -> None:
    """A joint of constant speed rises as evenly as a time does."""
    values = np.column_stack([0.1 + 0.4 * TIMES / TIMES[-1], writers.movement()])
    path = tmp_path / f"demo.{kind}"
    if kind == "csv":
        np.savetxt(path, values, delimiter=",")
    else:
        np.save(path, values)
    note = load(path, JOINTS).notes[0]
    assert "rises evenly from 0.1 to 0.5, so it is taken as the time in s; if it is a joint, give --rate" in note
    assert "if it is a joint, give --rate" in refusal(path, (*JOINTS, "joint_7"))
    assert load(path, (*JOINTS, "joint_7"), rate=100.0).values.shape == values.shape


@pytest.mark.parametrize("rows", [slice(None), slice(4, None)])
def test_a_joint_without_numbers_is_named(tmp_path: Path, rows: slice) -> None:
    said = refusal(array(tmp_path, positions=without(3, rows)))
    assert "demo.npz: " in said
    if rows.start is None:
        assert "no sample of positions has a number for joint_4" in said
        assert "record it, or choose another column for it with --map" in said
    else:
        assert "joint_4 4" in said or "joint_4 has numbers" in said


def test_samples_without_times_are_named(tmp_path: Path) -> None:
    path = array(tmp_path, np.full(len(TIMES), np.nan), positions=writers.movement())
    assert "no sample of positions has a time; give --rate" in refusal(path)


def test_a_joint_that_ends_early_is_refused_or_named(tmp_path: Path) -> None:
    said = refusal(array(tmp_path, positions=without(3, slice(10, None))))
    assert "joint_4 has numbers only from 0 to 0.09 s, and the recording lasts 1.5 s" in said
    recording = load(array(tmp_path, positions=without(3, slice(140, None))), JOINTS)
    assert recording.times[-1] == pytest.approx(1.39)
    assert any("joint_4" in note and "learned from 0 to 1.39 s of 1.5 s" in note for note in recording.notes)


def test_a_joint_of_its_own_topic_that_ends_early_is_refused(tmp_path: Path) -> None:
    lines = [f"{k / 100:.3f},{np.sin(k / 100):.6f}," for k in range(300)]
    lines += [f"{k / 100 + 0.004:.3f},,{np.cos(k / 100):.6f}" for k in range(60)]
    path = tmp_path / "demo.csv"
    path.write_text("t,joint_1,joint_2\n" + "\n".join(lines) + "\n", encoding="utf-8")
    assert "joint_2 has numbers only from 0.004 to 0.594 s" in refusal(path, TWO)


@pytest.mark.parametrize("samples", [0, 1])
def test_a_matrix_of_one_sample_is_named(tmp_path: Path, samples: int) -> None:
    values, times = writers.movement()[:samples], TIMES[:samples]
    said = refusal(array(tmp_path, times, positions=values))
    count = "1 sample" if samples else "0 samples"
    assert f"positions has {count}, ({samples}, 6); a movement needs at least 10" in said
    with h5py.File(tmp_path / "demo.hdf5", "w") as file:
        file["qpos"] = values
    assert f"qpos has {count}, ({samples}, 6); a movement needs at least 10" in refusal(tmp_path / "demo.hdf5")


def test_a_transposed_matrix_is_named(tmp_path: Path) -> None:
    said = refusal(array(tmp_path, positions=writers.movement().T))
    assert "positions is 6 × 151, and t has 151 times: save its transpose, one row a sample" in said
    with h5py.File(tmp_path / "demo.hdf5", "w") as file:
        file["qpos"], file["t"] = writers.movement().T, TIMES
    assert "qpos is 6 × 151, and t has 151 times: save its transpose" in refusal(tmp_path / "demo.hdf5")


def test_a_vector_is_refused_with_the_shape_that_works(tmp_path: Path) -> None:
    said = refusal(array(tmp_path, positions=writers.movement()[:, 0]))
    assert "positions (151,)" in said
    assert "save joint positions with one row a sample and one column a joint" in said


def test_a_bag_with_fewer_positions_than_names_says_so(tmp_path: Path) -> None:
    store = get_typestore(Stores.ROS2_HUMBLE)
    with BagWriter(tmp_path / "bag", version=9) as bag:
        topic = bag.add_connection("/joint_states", writers.JOINT_STATE, typestore=store)
        for stamp in range(20):
            message = writers.joint_state(store, JOINTS, np.zeros(5), stamp)
            bag.write(topic, stamp, store.serialize_cdr(message, writers.JOINT_STATE))
    assert "a message of /joint_states has 6 names and 5 positions" in refusal(tmp_path / "bag")


def test_a_mapping_of_names_that_no_joint_has_says_which(tmp_path: Path) -> None:
    np.savez(tmp_path / "demo.npz", t=TIMES, q=writers.movement()[:, :2], joint_names=np.array(["left_a", "left_b"]))
    said = refusal(tmp_path / "demo.npz", TWO, mapping={"left_*": "*"})
    assert "the robot has no joint 'a' for left_a; it has joint_1, joint_2" in said


def test_own_data_sets_are_in_rad_and_others_give_no_unit(tmp_path: Path) -> None:
    played = Recording(TIMES, JOINTS, writers.movement(), "rad", Path("trace.rrd"), "goal", True)
    write(played, tmp_path / "own")
    assert load(tmp_path / "own", JOINTS).unit == "rad"
    info = tmp_path / "own" / "meta" / "info.json"
    info.write_text(info.read_text(encoding="utf-8").replace('"volley"', '"so101"'), encoding="utf-8")
    assert load(tmp_path / "own", JOINTS).unit is None
    assert readers.read(tmp_path / "own").normalised
