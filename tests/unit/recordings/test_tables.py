"""Text tables and plain matrices: delimiters, headers, units of time, missing numbers."""

from pathlib import Path

import numpy as np
import pytest

from tools.recordings import readers
from tools.recordings.learning import in_radians, load
from tools.recordings.recording import Recording, Unreadable

TWO = "joint_1", "joint_2"


def table(tmp_path: Path, text: str, **options) -> Recording:
    """Write a table of two joints and load it."""
    path = tmp_path / "demo.csv"
    path.write_text(text, encoding="utf-8")
    return load(path, TWO, **options)


@pytest.mark.parametrize(
    "text",
    [
        "t,joint_1,joint_2\n0,1,2\n0.5,3,4\n",
        "0,1,2\n0.5,3,4\n",
        "0;1;2\n0.5;3;4\n",
        "0\t1\t2\n0.5\t3\t4\n",
        "  0 1   2\n0.5 3 4\n",
        "# made by hand\n\n0, 1, 2,\n0.5, 3, 4,\n",
        "# time, joint_2, joint_1\n0, 2, 1\n0.5, 4, 3\n",
        "time (s);joint_1;joint_2\n0,0;1,0;2,0\n0,5;3,0;4,0\n",
        '"time","joint_1","joint_2","note"\n0,1,2,"a, b"\n0.5,3,4,c\n',
        "\ufefftime,joint_1,joint_2\r\n0,1,2\r\n0.5,3,4\r\n",
        "index,t_ms,q1,q2\n0,100,1,2\n1,600,3,4\n",
        "timestamp_ns,q1,q2\n1790000000000000000,1,2\n1790000000500000000,3,4\n",
        "header.stamp.sec,header.stamp.nanosec,q1,q2\n8,900000000,1,2\n9,400000000,3,4\n",
        "time,q1,q2\n2026-11-29T12:00:00.25,1,2\n2026-11-29T12:00:00.75,3,4\n",
        "actual_execution_time,timestamp,actual_q_0,actual_q_1\n7,0,1,2\n7,0.5,3,4\n",
        "datetime,q1,q2\n2026-11-29T12:00:00.25,1,2\n2026-11-29T12:00:00.75,3,4\n",
        "ts,q1,q2\n0,1,2\n0.5,3,4\n",
        "when_ms,joint,position\n0,joint_1,1\n0,joint_2,2\n500,joint_1,3\n500,joint_2,4\n",
        "Zeitstempel,q1,q2\n0,1,2\n0.5,3,4\n",
        "t,q1,q2\n0,1,2\n0.2,,\n0.5,3,4\n",
        "0,1,2\n0.0,1.0,2.0\n0.5,3.0,4.0\n",
        "0;1;2\n0.0;1.0;2.0\n0.5;3.0;4.0\n",
        "t,q1,q2,q1_vel [deg/s]\n0,1,2,9\n0.5,3,4,9\n",
        "%time,field.name0,field.name1,field.position0,field.position1\n0,joint_2,joint_1,2,1\n5e8,joint_2,joint_1,4,3\n",
        "t,q1,q2\n0,1,2\n0.5,3,4\n0.7,5",
        "time,q1,q2\n[s],[rad],[rad]\n0,1,2\n0.5,3,4\n".replace(",[rad]", ",-"),
        "t,q1,q2\nms,,\n0,1,2\n500,3,4\n",
        "t,q1,q2\n0,1,2\n0.2,NA,null\n0.5,3,4\n",
        "sep=;\nZeit;Gelenk1;Gelenk2\n0,0;1;2\n0,5;3;4\n",
        '"t","q1","q2"\n"0,0","1,0","2,0"\n"0,5","3,0","4,0"\n',
        "t,q1,q2\n0.0D+00,1.0D+00,2.0D+00\n5.0D-01,3.0D+00,4.0D+00\n",
        "sec,usec,q1,q2\n8,900000,1,2\n9,400000,3,4\n",
        "tv_sec,tv_nsec,q1,q2\n8,900000000,1,2\n9,400000000,3,4\n",
        "time,q1,q2\n23:59:58.25,1,2\n23:59:58.75,3,4\n",
        "time;q1;q2\n29.11.2026 12:00:00,25;1;2\n29.11.2026 12:00:00,75;3;4\n",
        "t [min],q1,q2\n0,1,2\n0.008333333333,3,4\n",
        "time,joint,position\n0,joint_1,1\n0,joint_2,2\n0.5,joint_1,3\n0.5,joint_2,4\n",
        "time,variable,value\n0,joint_1,1\n0.5,joint_1,3\n0,joint_2,2\n0.5,joint_2,4\n",
        "t_ms;name;position;velocity\n0;q2;2;9\n0;q1;1;9\n500;q2;4;9\n500;q1;3;9\n",
        "joint,time,position\n1,0,1\n2,0,2\n1,0.5,3\n2,0.5,4\n",
        "time,joint,position\n0,joint_1,1\n0,joint_2,2\n0.5,joint_1,3\n0.5,joint_2,4\n0.7,join",
    ],
)
def test_dialects_of_tables_are_read_alike(tmp_path: Path, text: str):
    recording = table(tmp_path, text)
    assert recording.values.tolist() == [[1, 2], [3, 4]]
    assert recording.times - recording.times[0] == pytest.approx([0, 0.5], abs=1e-6)
    assert (recording.unit, recording.stamped) == (None, True)


@pytest.mark.parametrize(
    ("step", "unit"), [(0.002, 1.0), (0.5, 1.0), (2, 1e-3), (33, 1e-3), (500, 1e-6), (2000, 1e-6), (2_000_000, 1e-9)]
)
def test_an_undeclared_unit_of_time_follows_from_the_sample_period(tmp_path: Path, step: float, unit: float):
    recording = table(tmp_path, "t,q1,q2\n" + "".join(f"{k * step},1,2\n" for k in range(20)))
    assert recording.times[1] == pytest.approx(step * unit)
    assert (unit == 1.0) == (recording.notes == ())


def test_the_unit_of_time_does_not_depend_on_the_order_of_the_lines(tmp_path: Path):
    shuffled = np.random.default_rng(1).permutation(50) * 0.02
    recording = table(tmp_path, "t,q1,q2\n" + "".join(f"{time:.2f},1,2\n" for time in shuffled))
    assert np.ptp(recording.times) == pytest.approx(0.98)


def test_a_column_of_words_that_names_several_joints_is_refused(tmp_path: Path):
    with pytest.raises(Unreadable, match=r"field.name0 names several joints"):
        table(tmp_path, "t,field.name0,field.position0\n0,joint_1,1\n0.1,joint_2,2\n")


def test_a_line_for_each_joint_may_have_a_time_of_its_own(tmp_path: Path):
    lines = [f"{0.1 * k + offset},{name},{k}" for k in range(20) for name, offset in (("1", 0.0), ("2", 0.03))]
    recording = table(tmp_path, "time,joint,position_deg\n" + "\n".join(lines))
    assert recording.unit == "deg"
    assert recording.values[:, 0] - recording.values[:, 1] == pytest.approx(np.full(len(recording.times), 0.3))
    rated = table(tmp_path, "joint,position\n" + "\n".join(line.partition(",")[2] for line in lines), rate=10)
    assert (rated.times[-1], rated.values[-1].tolist()) == (pytest.approx(1.9), [19, 19])


def test_words_that_name_no_joint_are_not_taken_for_names(tmp_path: Path):
    """A column of words beside one joint, and a column of whole numbers beside several, remain what they were."""
    path = tmp_path / "demo.csv"
    path.write_text("time,phase,elbow\n0,reach,1\n0.5,grasp,2\n")
    assert load(path, ["elbow"]).values.tolist() == [[1], [2]]
    assert table(tmp_path, "time,id,joint_1,joint_2\n0,1,1,2\n0.5,2,3,4\n").values.tolist() == [[1, 2], [3, 4]]


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16", "utf-16-le", "utf-16-be", "latin-1", "cp1252", "utf-8"])
def test_encodings_of_text_are_recognised(tmp_path: Path, encoding: str):
    """Those of spreadsheets and older programs; the unit ° is recognised in all of them."""
    (tmp_path / "demo.csv").write_text("Zeit [s];q1 [°];q2 [°]\n0,0;1;2\n0,5;3;4\n", encoding=encoding)
    recording = load(tmp_path / "demo.csv", TWO)
    assert (recording.values.tolist(), recording.unit) == ([[1, 2], [3, 4]], "deg")


def test_letters_in_another_encoding_far_down_the_file_are_ignored(tmp_path: Path):
    lines = "".join(f"{k / 100},{k},{k}\n" for k in range(500)) + "# geprüft\n5,500,500\n"
    (tmp_path / "demo.csv").write_bytes(("t,q1,q2\n" + lines).encode("latin-1"))
    assert load(tmp_path / "demo.csv", TWO).values[-1].tolist() == [500, 500]


@pytest.mark.parametrize("word", ["des", "temp"])
def test_other_quantities_are_not_taken_for_positions(tmp_path: Path, word: str):
    with pytest.raises(Unreadable, match="no column for joint_1, joint_2"):
        table(tmp_path, f"t,joint_1_{word},joint_2_{word}\n0,1,2\n0.1,3,4\n")


@pytest.mark.parametrize(
    ("word", "size"),
    [("turns", 2 * np.pi), ("rev", 2 * np.pi), ("mrad", 1e-3), ("gon", np.pi / 200), ("mdeg", np.pi / 180e3)],
)
def test_other_units_of_angles_are_converted(tmp_path: Path, word: str, size: float):
    recording = table(tmp_path, f"t,joint_1 [{word}],joint_2_{word}\n0,1,2\n0.1,3,4\n")
    assert (recording.unit, recording.values.tolist()) == (
        "rad",
        [pytest.approx([size, 2 * size]), pytest.approx([3 * size, 4 * size])],
    )


@pytest.mark.parametrize("word", ["ticks", "counts", "%", "percent"])
def test_units_other_than_angles_are_refused(tmp_path: Path, word: str):
    for mapping in ({}, {f"joint_*_{word}": "joint_*"}):
        with pytest.raises(Unreadable, match="not an angle by its name"):
            table(tmp_path, f"t,joint_1_{word},joint_2_{word}\n0,1,2\n0.1,3,4\n", mapping=mapping)


def test_a_column_of_times_or_indices_is_not_taken_for_a_joint(tmp_path: Path):
    timed = "".join(f"{k / 100},{k % 3},{k % 2}\n" for k in range(9))
    recording = table(tmp_path, timed, rate=50.0)
    assert (recording.values[:3].tolist(), recording.times[1]) == ([[0, 0], [1, 1], [2, 0]], 0.02)
    assert recording.notes[0] == "the first column rises evenly, as a time or an index does, and is left out"
    with pytest.raises(Unreadable, match="more than one rises evenly"):
        table(tmp_path, "".join(f"{k},{line}\n" for k, line in enumerate(timed.splitlines())))


def test_units_in_column_names_are_recognised(tmp_path: Path):
    assert table(tmp_path, "t,q1_deg,q2_deg\n0,1,2\n0.5,3,4\n").unit == "deg"
    mixed = table(tmp_path, "t,q1 [deg],q2 [rad]\n0,180,2\n0.5,90,4\n")
    assert (mixed.unit, mixed.values[0].tolist()) == ("rad", [pytest.approx(np.pi), 2])


def test_an_incomplete_last_line_is_left_out(tmp_path: Path):
    recording = table(tmp_path, "t,q1,q2\n0,1,2\n0.5,3,4\n0.7,5")
    assert recording.notes == (
        "the last line is truncated and was left out (line 4 has 2 columns where the first line has 3)",
    )


@pytest.mark.parametrize("end", ["0", "0.7", "0.7,", "0.7,5,6e", "0.7,5,6.5e-"])
def test_a_last_line_that_is_cut_off_anywhere_is_left_out(tmp_path: Path, end: str):
    recording = table(tmp_path, f"t,q1,q2\n0,1,2\n0.5,3,4\n{end}")
    assert recording.values.tolist() == [[1, 2], [3, 4]]
    assert recording.notes[0].startswith("the last line is truncated and was left out (line 4 ")


def test_a_matrix_without_names_is_read_with_or_without_a_column_of_times(tmp_path: Path):
    path = tmp_path / "demo.npy"
    np.save(path, np.array([[1, 2], [3, 4], [5, 6]]))
    assert load(path, TWO, rate=100.0).values.tolist() == [[1, 2], [3, 4], [5, 6]]
    timed = load(path, ("joint_1",), duration=2.0)
    assert (timed.times.tolist(), timed.values.tolist()) == ([0, 1, 2], [[2], [4], [6]])


@pytest.mark.parametrize("stamps", ["jitter", "bursts", "gap"])
def test_an_unnamed_first_column_of_uneven_stamps_is_the_time(tmp_path: Path, stamps: str):
    times = np.arange(400) / 100
    if stamps == "jitter":
        times[1:-1] += np.random.default_rng(0).uniform(-0.003, 0.003, 398)
    elif stamps == "bursts":
        times = np.floor(20 * times + 1e-9) / 20
    else:
        times[200:] += 1.0
    np.save(tmp_path / "demo.npy", np.column_stack([times, np.sin(times)]))
    assert load(tmp_path / "demo.npy", ("joint_1",)).times == pytest.approx(times)


@pytest.mark.parametrize("name", ["demo.npy", "demo.csv"])
def test_an_unnamed_first_column_that_moves_like_a_joint_is_not_the_time(tmp_path: Path, name: str):
    s = np.linspace(0, 1, 101)
    matrix = np.column_stack([s**3 * (10 + s * (6 * s - 15)), np.sin(s)])
    if name.endswith("npy"):
        np.save(tmp_path / name, matrix)
    else:
        np.savetxt(tmp_path / name, matrix, delimiter=",")
    with pytest.raises(Unreadable, match="give --rate, in samples a second"):
        load(tmp_path / name, ("joint_1",))
    assert load(tmp_path / name, TWO, rate=100.0).values == pytest.approx(matrix)


@pytest.mark.parametrize("lost", [np.nan, np.inf])
@pytest.mark.parametrize("name", ["demo.npy", "demo.npz"])
def test_a_sample_without_a_time_does_not_change_the_unit_of_the_others(tmp_path: Path, name: str, lost: float):
    times = np.arange(50) / 100
    times[5] = lost
    matrix = np.column_stack([np.sin(np.arange(50) / 100)] * 2)
    if name.endswith("npy"):
        np.save(tmp_path / name, np.column_stack([times, matrix]))
    else:
        np.savez(tmp_path / name, t=times, positions=matrix)
    recording = load(tmp_path / name, TWO)
    assert recording.times[np.isfinite(recording.times)][-1] == pytest.approx(0.49)


def test_numbers_too_large_for_any_unit_of_angles_are_refused(tmp_path: Path):
    with pytest.raises(Unreadable, match=r"2 is -1e\+300 in sample 1; .* at most 1e\+09 .* --map"):
        table(tmp_path, "t,q1,q2\n0,1,2\n0.5,3,-1e300\n")


def test_a_rate_gives_the_times(tmp_path: Path):
    recording = table(tmp_path, "q1,q2\n1,2\n3,4\n", rate=50.0)
    assert (recording.times.tolist(), recording.stamped) == ([0, 0.02], False)


def test_a_duration_for_times_that_do_not_rise_is_refused(tmp_path: Path):
    with pytest.raises(Unreadable, match="do not rise and cannot be stretched; give --rate"):
        table(tmp_path, "t,q1,q2\n1,1,2\n1,3,4\n", duration=1.0)


def test_a_long_recording_is_thinned_to_at_most_100_000_samples(tmp_path: Path):
    path = tmp_path / "demo.npz"
    np.savez(path, t=np.arange(250_000) / 1000, positions=np.arange(500_000).reshape(-1, 2) / 1e6)
    recording = in_radians(load(path, TWO))
    assert (len(recording.times), recording.times[1]) == (83_334, 0.003)
    assert recording.values[1] == pytest.approx([6e-6, 7e-6])
    assert recording.notes[-1] == "one sample in 3 is learned, of 250000"


def test_episodes_have_sample_count_and_duration(tmp_path: Path):
    (tmp_path / "swing.csv").write_text("t,q1\n0,1\n0.1,2\n0.3,2\n")
    (found,) = readers.episodes(tmp_path / "swing.csv")
    assert (found.name, found.samples, found.duration) == ("swing", 3, 0.3)
