"""The library of primitives on disk."""

import logging
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from motion.demonstration import Demonstration
from motion.primitive import Primitive, learn
from protocol.errors import Refusal
from services.planner.__main__ import take_over
from services.planner.archive import to_arrays
from services.planner.library import Arm, Library

LOG = logging.getLogger("test")
ARM = Arm("two", ("a", "b"))


@pytest.fixture(scope="module")
def primitive() -> Primitive:
    """Any primitive."""
    times = np.linspace(0.0, 1.0, 100)
    return learn(Demonstration(times, np.sin(np.outer(times, [1.0, 2.0]))))


def names(library: Library) -> list[str]:
    """Return the names of the library's primitives."""
    return [entry.name for entry in library]


def test_a_stored_primitive_is_read_back_exactly(tmp_path: Path, primitive: Primitive):
    first = Library(tmp_path / "library", ARM, LOG)
    assert first.is_new
    first.put("swing", primitive)
    first.put("a-2_b", primitive)
    second = Library(tmp_path / "library", ARM, LOG)
    assert not second.is_new
    assert names(second) == ["a-2_b", "swing"]
    assert list(second) == list(first)
    assert second.get("swing").control_points.tobytes() == primitive.control_points.tobytes()
    assert second.get("swing").duration == primitive.duration
    assert second.get("swing").smoothing == primitive.smoothing


def test_an_empty_directory_is_a_new_library_until_it_begins(tmp_path: Path):
    """It may be made before the first start; once begun, what was removed is not learned again."""
    library = Library(tmp_path, ARM, LOG)
    assert library.is_new
    library.begin()
    assert not Library(tmp_path, ARM, LOG).is_new


def test_a_removed_primitive_is_removed_from_memory_and_disk(tmp_path: Path, primitive: Primitive):
    """Removing it again is refused as unknown."""
    library = Library(tmp_path, ARM, LOG)
    library.put("swing", primitive)
    library.remove("swing")
    assert names(library) == names(Library(tmp_path, ARM, LOG)) == []
    with pytest.raises(Refusal) as caught:
        library.remove("swing")
    assert (caught.value.code, caught.value.detail["name"]) == ("unknown_primitive", "swing")


def test_an_unknown_name_is_refused_with_the_existing_ones(tmp_path: Path, primitive: Primitive):
    library = Library(tmp_path, ARM, LOG)
    with pytest.raises(Refusal, match="none yet"):
        library.get("lob")
    library.put("swing", primitive)
    with pytest.raises(Refusal, match="there is swing"):
        library.get("lob")


@pytest.mark.parametrize("name", ["", "../escape", "/etc/passwd", "a.b", "a b", "-a", "_a", "ä", "x" * 65, "a\n"])
def test_invalid_names_are_refused(tmp_path: Path, name: str):
    """In particular no name may lead out of the directory."""
    with pytest.raises(Refusal) as caught:
        Library(tmp_path, ARM, LOG).check_name(name, replace=True)
    assert (caught.value.code, caught.value.detail["field"]) == ("bad_message", "name")


def test_an_existing_name_is_refused_unless_replaced(tmp_path: Path, primitive: Primitive):
    library = Library(tmp_path, ARM, LOG)
    library.check_name("swing", replace=False)
    library.put("swing", primitive)
    with pytest.raises(Refusal) as caught:
        library.check_name("swing", replace=False)
    assert (caught.value.code, caught.value.detail["name"]) == ("exists", "swing")
    library.check_name("swing", replace=True)


def test_files_that_are_no_primitives_are_reported_and_kept(
    tmp_path: Path, primitive: Primitive, caplog: pytest.LogCaptureFixture
):
    """The valid ones are loaded."""
    Library(tmp_path, ARM, LOG).put("swing", primitive)
    whole = (tmp_path / "swing.npz").read_bytes()
    bad = {"cut": whole[: len(whole) // 2], "empty": b"", "noise": bytes(range(256)) * 10}
    for name, content in bad.items():
        (tmp_path / f"{name}.npz").write_bytes(content)
    np.savez(tmp_path / "other.npz", created=1.0, theta=np.zeros(3))
    np.savez(tmp_path / "pickle.npz", created=np.array([object()], dtype=object))
    assert names(Library(tmp_path, ARM, LOG)) == ["swing"]
    for name in (*bad, "other", "pickle"):
        assert (tmp_path / f"{name}.npz").exists()
        assert f"{name}.npz is not a primitive" in caplog.text


def test_a_damaged_file_is_kept(tmp_path: Path, primitive: Primitive):
    """The damage is in the headers of the archive and its arrays."""
    Library(tmp_path, ARM, LOG).put("swing", primitive)
    whole = (tmp_path / "swing.npz").read_bytes()
    headers = [place for place in range(len(whole)) if whole.startswith(b"PK\x03\x04", place)]
    for header in headers[:4]:
        for place in range(header, header + 160, 3):
            (tmp_path / "swing.npz").write_bytes(whole[:place] + bytes([whole[place] ^ 0x11]) + whole[place + 1 :])
            assert names(Library(tmp_path, ARM, LOG)) in ([], ["swing"])
            assert (tmp_path / "swing.npz").exists()


def test_a_file_with_gaussian_weights_is_converted(tmp_path: Path):
    """A previous version wrote such files; the time of learning is kept."""
    s = np.linspace(0, 1, 1001)
    positions = np.stack([0.5 * np.sin(3 * s), s**2], axis=1)
    old = {"duration": 2.0, "theta": np.zeros((2, 50)), "positions": positions, "accelerations": positions}
    old |= {"ends": np.zeros((2, 3, 2)), "samples": 400, "fit_rms": np.ones(2), "noise_estimate": np.ones(2)}
    np.savez(tmp_path / "swing.npz", created=5.0, smoothing=np.zeros(0), **old)
    (described,) = library = list(Library(tmp_path, ARM, LOG))
    assert (described.name, described.created, described.duration, described.samples) == ("swing", 5.0, 2.0, 400)
    with np.load(tmp_path / "swing.npz") as archive:
        assert "control_points" in archive
    again = Library(tmp_path, ARM, LOG)
    assert list(again) == library
    assert np.abs(again.get("swing").positions(s) - positions).max() < 1e-6


def test_a_failed_write_keeps_the_previous_file(tmp_path: Path, primitive: Primitive, monkeypatch):
    """Temporary files are removed, also those of a planner that was killed."""
    library = Library(tmp_path, ARM, LOG)
    library.put("swing", primitive)
    before = (tmp_path / "swing.npz").read_bytes()

    def full(*_: object, **__: object) -> None:
        raise OSError("no space left on device")

    monkeypatch.setattr(np, "savez", full)
    with pytest.raises(Refusal, match="cannot be written: no space") as refused:
        library.put("swing", primitive)
    assert (refused.value.code, refused.value.detail) == ("unavailable", {"service": "planner"})
    assert (tmp_path / "swing.npz").read_bytes() == before
    assert not list(tmp_path.glob(".*.tmp"))
    (tmp_path / ".swing.tmp").touch()
    assert names(Library(tmp_path, ARM, LOG)) == ["swing"]
    assert not list(tmp_path.glob(".*.tmp"))


def test_a_full_library_refuses_new_names(tmp_path: Path, primitive: Primitive, monkeypatch: pytest.MonkeyPatch):
    """Existing names can be replaced, and removing one makes room."""
    monkeypatch.setattr("services.planner.library.MAX_PRIMITIVES", 2)
    library = Library(tmp_path, ARM, LOG)
    for name in ("one", "two"):
        library.check_name(name, replace=False)
        library.put(name, primitive)
    with pytest.raises(Refusal, match="forget one first"):
        library.check_name("three", replace=True)
    library.check_name("two", replace=True)
    library.remove("one")
    library.check_name("three", replace=False)


def test_a_refusal_lists_ten_names_and_counts_the_others(tmp_path: Path, primitive: Primitive):
    library = Library(tmp_path, ARM, LOG)
    for number in range(12):
        library.put(f"swing-{number:02}", primitive)
    with pytest.raises(Refusal, match=r"swing-09 and 2 more$"):
        library.get("serve")


def test_a_primitive_is_stored_with_its_arm(tmp_path: Path, primitive: Primitive):
    """Another arm lists it but refuses to play it."""
    Library(tmp_path, ARM, LOG).put("swing", primitive)
    (entry,) = Library(tmp_path, ARM, LOG)
    assert (entry.robot, entry.joint_names) == ("two", ["a", "b"])
    other = Library(tmp_path, Arm("other", ("b", "a")), LOG)
    assert list(other) == [entry]
    with pytest.raises(Refusal, match="learned on two, whose joints are a, b; those of this arm are b, a") as caught:
        other.playable("swing")
    assert (caught.value.code, caught.value.detail["field"]) == ("invalid_goal", "primitive")
    namesake = Library(tmp_path, Arm("left", ARM.joint_names), LOG)
    assert namesake.playable("swing").duration == primitive.duration


def test_a_primitive_of_an_earlier_version_is_playable_by_any_arm(tmp_path: Path, primitive: Primitive):
    np.savez(tmp_path / "swing.npz", created=5.0, **to_arrays(primitive))  # type: ignore[arg-type]
    library = Library(tmp_path, ARM, LOG)
    (entry,) = library
    assert (entry.robot, entry.joint_names, entry.created) == ("", [], 5.0)
    assert library.playable("swing").duration == primitive.duration


def test_the_shipped_arm_takes_over_the_library_that_arms_shared(
    tmp_path: Path, primitive: Primitive, caplog: pytest.LogCaptureFixture
):
    """Another arm only logs where it is, because these primitives do not name their arm."""
    np.savez(tmp_path / "swing.npz", created=5.0, **to_arrays(primitive))  # type: ignore[arg-type]
    (tmp_path / "noise.npz").write_bytes(b"noise")
    shipped = Library(tmp_path / "two", ARM, LOG)
    shipped.put("forehand", primitive)
    take_over(shipped, tmp_path, "two", LOG)
    assert "noise.npz is not a primitive" in caplog.text
    assert [(entry.name, entry.robot) for entry in Library(tmp_path / "two", ARM, LOG)] == [
        ("forehand", "two"),
        ("swing", "two"),
    ]
    other = Library(tmp_path / "other", Arm("other", ("c", "d")), LOG)
    take_over(other, tmp_path, "other", LOG)
    assert names(other) == []
    assert f"move this robot's into {tmp_path / 'other'}" in caplog.text


def test_a_library_that_cannot_be_created_is_reported_in_a_sentence(tmp_path: Path):
    (tmp_path / "file").touch()
    command = [sys.executable, "-m", "services.planner", "--library", str(tmp_path / "file")]
    planner = subprocess.run(command, capture_output=True, text=True, check=False)
    assert planner.returncode == 2
    assert "file cannot be used: File exists; name another directory with --library" in planner.stderr
    assert "Traceback" not in planner.stderr
