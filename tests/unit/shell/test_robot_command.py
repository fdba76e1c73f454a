"""`volley robot`: written files, exit statuses, and errors in one sentence."""

from pathlib import Path

import pytest

from robot.description import load_robot
from tests import models
from tools.shell.__main__ import main


def test_import_writes_a_file_that_loads_and_checks(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "ur5e.toml"
    assert main(["robot", "import", str(models.UR5E_URDF), "--name", "left", "-o", str(out)]) == 0
    said = capsys.readouterr()
    assert f"volley robot check {out}" in said.out
    assert "--tool may name another, as flange" in said.err
    assert load_robot(out).name == "left"
    assert main(["robot", "check", str(out)]) == 0
    said = capsys.readouterr().out
    assert "file: velocity" in said
    assert "to decide, marked DECIDE: max_tracking_error" in said
    assert "physics step" in said
    assert "the arm can be started" in said
    assert main(["robot", "import", str(models.UR5E_URDF), "-o", str(out)]) == 2
    assert "exists already" in capsys.readouterr().err


def test_without_an_output_file_the_toml_alone_is_printed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["robot", "import", str(models.UR5E_URDF)]) == 0
    file = tmp_path / "elsewhere.toml"
    file.write_text(capsys.readouterr().out)
    assert load_robot(file).joint_count == 6


def test_check_of_an_unusable_arm_exits_with_1(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The xArm7 of gym-xarm is welded to a mocap body."""
    out = tmp_path / "xarm.toml"
    assert main(["robot", "import", str(models.XARM7), "-o", str(out)]) == 0
    assert main(["robot", "check", str(out)]) == 1
    said = capsys.readouterr().out
    assert "unusable: a weld of robot0:mocap2 to link7 works against joint1" in said
    assert said.count("unusable:") == 1


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["import", "absent.urdf"], "name a URDF or MJCF file"),
        (["import", "absent.xml"], "there is no file"),
        (["import", str(models.UR5E_URDF), "--tool", "hand"], "no such site or body"),
        (["import", str(models.UR5E_URDF), "-o", "/absent/arm.toml"], "cannot be written"),
        (["check", "absent.toml"], "cannot be read"),
    ],
)
def test_mistakes_are_reported_in_one_sentence(
    words: list[str], sentence: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["robot", *words]) == 2
    said = capsys.readouterr().err
    assert sentence in said
    assert "Traceback" not in said
