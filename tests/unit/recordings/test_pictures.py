"""`volley inspect` and its plots of a recording and the primitive learned from it."""

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from tools.shell.__main__ import main
from tools.trace_reader import read_trace

JOINTS = [f"joint_{number}" for number in range(1, 7)]
HOME = np.array([0.0, 0.52, 0.82, -0.2, 0.0, 0.09])


@pytest.fixture
def spiked(tmp_path: Path) -> Path:
    """Table of a reach of the shipped arm in degrees, with an outlier and a long rest."""
    s = np.clip(np.linspace(0, 2, 401), 0, 1)[:, None]
    values = np.degrees(HOME + 0.4 * s**3 * (10 + s * (6 * s - 15)))
    values[90, 2] += 40
    path = tmp_path / "reach.csv"
    np.savetxt(path, np.column_stack([np.arange(401) / 200, values]), delimiter=",", header="time," + ",".join(JOINTS),
               comments="")  # fmt: skip
    return path


def test_inspect_reports_findings_and_plots_the_curves(spiked: Path, capsys: pytest.CaptureFixture[str]) -> None:
    picture = spiked.with_suffix(".png")
    assert main(["inspect", str(spiked), "--plot", str(picture)]) == 0
    said = capsys.readouterr().out
    for part in ("in degrees: converted", "joint_3 has 1 outlier", "at the end: trimmed to 0.1 s"):
        assert part in said
    with Image.open(picture) as image:
        drawn = np.asarray(image.convert("RGB"), dtype=int)
    fitted = np.abs(drawn - np.array([38, 139, 210])).sum(axis=2) < 30
    assert fitted.sum() > 1000


def test_inspect_reports_the_duration_that_keeps_the_limits(spiked: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["inspect", str(spiked), "--duration", "0.2"]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "the movement passes limits of the arm (joint_" in said
    assert "s or more it keeps them" in said


def test_a_plot_for_the_viewer_has_curves_and_findings(spiked: Path) -> None:
    picture = spiked.with_suffix(".rrd")
    assert main(["inspect", str(spiked), "--plot", str(picture)]) == 0
    trace = read_trace(picture)
    raw, fitted, imitated = (trace.scalars(f"/preview/joint_3/{kind}") for kind in ("raw", "fitted", "imitated"))
    assert raw.max() == pytest.approx(HOME[2] + np.radians(40), abs=0.3)
    assert np.abs(fitted - imitated).max() < 0.01
    assert fitted[-1] == pytest.approx(HOME[2] + 0.4, abs=1e-3)
    assert any("outlier" in text for text in trace.texts("/preview/findings"))


def test_a_recording_that_cannot_be_learned_is_reported_in_one_sentence(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "still.csv"
    np.savetxt(path, np.column_stack([np.arange(50) / 50, np.tile(HOME, (50, 1))]), delimiter=",",
               header="time," + ",".join(JOINTS), comments="")  # fmt: skip
    assert main(["inspect", str(path)]) == 2
    assert "cannot be learned: no joint moves farther than" in capsys.readouterr().err.splitlines()[-1]


def test_a_plot_with_an_unknown_ending_is_refused(spiked: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["inspect", str(spiked), "--plot", "picture.bmp"]) == 2
    assert "must end in .png, or in .rrd" in capsys.readouterr().err


def test_a_plot_into_an_absent_directory_or_onto_the_recording_is_refused(
    spiked: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for ending in ("png", "rrd"):
        assert main(["inspect", str(spiked), "--plot", str(tmp_path / "absent" / f"x.{ending}")]) == 2
        assert f"there is no directory {tmp_path / 'absent'}" in capsys.readouterr().err
    trace = spiked.rename(tmp_path / "reach.rrd")
    before = trace.read_bytes()
    assert main(["inspect", str(trace), "--plot", str(trace)]) == 2
    assert "would overwrite the recording" in capsys.readouterr().err
    assert trace.read_bytes() == before


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--duration", "-1"), "--duration is -1; it must be a number greater than 0"),
        (("--duration", "nan"), "--duration is nan"),
        (("--rate", "0"), "--rate is 0; it must be a number greater than 0"),
        (("--rate", "inf"), "--rate is inf"),
        (("--rate", "50", "--duration", "2"), "both set the times"),
        (("--map", "a=joint_1", "--map", "a=joint_2"), "--map a=joint_1: 'a' is also mapped to 'joint_2'"),
    ],
)
def test_invalid_flags_are_reported_in_a_sentence(
    spiked: Path, capsys: pytest.CaptureFixture[str], words: tuple[str, ...], said: str
) -> None:
    assert main(["inspect", str(spiked), *words]) == 2
    assert said in capsys.readouterr().err
