"""The systemd units against the process table, the services' flags, and systemd itself."""

import importlib
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
import tyro

import deploy
from deploy.processes import PROCESSES, Process
from services.common.realtime import PROMPT_NICE, RECEIVING_PRIORITY, STEADY_NICE
from services.common.single_instance import Outcome
from services.common.supervisor import ENDING_S

DIRECTORY = Path(deploy.__file__).parent / "systemd"
PYTHON = "/opt/volley/.venv/bin/python"
NAMES = [process.name for process in PROCESSES]
REAL_TIME = {"sim": 40, "controller": 50}
"""The priorities for which these two ask."""

EACH = pytest.mark.parametrize("process", PROCESSES, ids=NAMES)


def unit(process: Process) -> dict[str, str]:
    """Return the settings of a process's unit; each may be set once only."""
    settings: dict[str, str] = {}
    for line in (DIRECTORY / f"volley-{process.name}@.service").read_text().splitlines():
        name, equals, value = line.partition("=")
        if equals:
            assert name not in settings, name
            settings[name] = value
    return settings


def services(names: list[str]) -> set[str]:
    """Return the names of the units of some processes."""
    return {f"volley-{name}@%i.service" for name in names}


def test_every_process_has_a_unit_and_nothing_else():
    assert {path.name for path in DIRECTORY.iterdir()} == {
        "volley@.target",
        *(name.replace("%i", "") for name in services(NAMES)),
    }
    wants = [line for line in (DIRECTORY / "volley@.target").read_text().splitlines() if line.startswith("Wants=")]
    started = services([process.name for process in PROCESSES if not process.optional])
    assert set(wants[0].removeprefix("Wants=").split()) == started


@EACH
def test_the_order_is_the_table_s(process: Process):
    """Units stop in the reverse of their order."""
    settings = unit(process)
    before = services(NAMES[: NAMES.index(process.name)])
    assert set(settings["After"].split()) - {"network-online.target"} == before
    assert settings["PartOf"] == "volley@%i.target"


@EACH
def test_the_service_accepts_its_command_line(process: Process):
    words = unit(process)["ExecStart"].replace("%i", "arm").split()
    assert words[:3] == [PYTHON, "-m", process.module]
    assert words.pop() == "$VOLLEY_FLAGS"
    flags = tyro.cli(importlib.import_module(f"{process.module}.__main__").Flags, args=words[3:])
    role = "router" if process.hosts_bus else process.name
    assert flags.common.zenoh_config == Path(f"/etc/volley/arm/zenoh/{role}.json5")
    assert not flags.common.listen, "where it listens stands in its configuration"
    assert not flags.common.insecure
    assert flags.common.log == "json"


@EACH
def test_limits_and_ends(process: Process):
    settings = unit(process)
    if process.name in REAL_TIME:
        assert int(settings["LimitRTPRIO"]) >= REAL_TIME[process.name]
        assert settings["LimitMEMLOCK"] == "infinity"
        assert len(settings["CPUAffinity"].split()) == 1
    else:
        assert settings["LimitNICE"] == str(STEADY_NICE if process.name == "recorder" else PROMPT_NICE)
        prompt = None if process.name == "recorder" else str(RECEIVING_PRIORITY)
        assert settings.get("LimitRTPRIO") == prompt
        assert "LimitMEMLOCK" not in settings
    assert "RestrictRealtime" not in settings, "it forbids SCHED_FIFO"
    assert str(Outcome.TAKEN) in settings["RestartPreventExitStatus"].split()
    assert settings["Restart"] == "on-failure"
    assert settings["TimeoutStopSec"] == f"{ENDING_S:.0f}s"
    assert (settings["User"], settings["NoNewPrivileges"], settings["CapabilityBoundingSet"]) == ("volley", "yes", "")


def test_loops_have_separate_cores():
    cores = [set(unit(process)["CPUAffinity"].split()) for process in PROCESSES if process.name in REAL_TIME]
    rest = [set(unit(process)["CPUAffinity"].split()) for process in PROCESSES if process.name not in REAL_TIME]
    assert not cores[0] & cores[1]
    assert not set.union(*cores) & set.union(*rest)


def test_the_recorder_keeps_no_index_in_memory():
    """Traces keep no index in memory; each start writes a new file named by the time."""
    recorder = next(process for process in PROCESSES if process.name == "recorder")
    words = unit(recorder)["ExecStart"].removesuffix(" $VOLLEY_FLAGS").replace("%i", "arm").split()
    own = tyro.cli(importlib.import_module(f"{recorder.module}.__main__").Flags, args=words[3:]).own
    assert own.unindexed
    assert own.record is None


@pytest.mark.skipif(not shutil.which("systemd-analyze"), reason="no systemd-analyze on this machine")
def test_systemd_accepts_the_units(tmp_path: Path):
    """As units of the robot `arm`, with a Python that exists."""
    for path in DIRECTORY.iterdir():
        for name in (path.name, path.name.replace("@", "@arm")):
            (tmp_path / name).write_text(path.read_text().replace(PYTHON, sys.executable))
    units = [str(path) for path in sorted(tmp_path.iterdir()) if "@arm" in path.name]
    done = subprocess.run(["systemd-analyze", "verify", *units], check=False, capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")
