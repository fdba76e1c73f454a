"""The machine of a benchmark, and its file of results."""

import json
import os
import platform
from importlib.metadata import version
from pathlib import Path

RESULTS = Path(__file__).parent / "results"
PACKAGES = ("numpy", "scipy", "piqp", "cvxopt", "daqp", "clarabel", "ruckig", "movement-primitives", "eclipse-zenoh")


def describe() -> dict[str, object]:
    """Return processor, cores, load and versions."""
    names = [
        line.split(":")[1].strip() for line in Path("/proc/cpuinfo").read_text().splitlines() if "model name" in line
    ]
    return {
        "processor": names[0] if names else platform.processor(),
        "cores": os.cpu_count(),
        "load_average": os.getloadavg(),
        "python": platform.python_version(),
        "packages": {name: version(name) for name in PACKAGES},
    }


def save(name: str, results: object) -> Path:
    """Write results, with a description of the machine, into `results`."""
    RESULTS.mkdir(exist_ok=True)
    path = RESULTS / f"{name}.json"
    path.write_text(json.dumps({"machine": describe(), "results": results}, indent=2) + "\n")
    return path
