"""`python -m tools.screenshot TRACE.rrd OUT.png`: a screenshot of a trace in the viewer, without a display.

It needs a graphics driver, for example Mesa's software rasterizer (Debian: mesa-vulkan-drivers). The viewer of the
Rerun package runs with a temporary home directory, in which its analytics are turned off.
"""

import contextlib
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import rerun_cli
import tyro
from rerun.experimental import ViewerClient
from tyro.conf import Positional

from services.common.cli import free_endpoint

LOAD_TIMEOUT_S = 240.0
"""Timeout of the viewer's start and its loading of the trace; a busy machine needs more than a minute."""
NO_DRIVER = "Failed to get render context"
"""Part of the viewer's output on a machine without a graphics driver."""
LAST = 400
"""Number of characters of the viewer's output that an error repeats."""
TRIES = 4
"""Largest number of attempts to save the screenshot."""
SETTLE_S = 2.0
"""Time from the end of loading until the viewer has drawn all views."""


def take_screenshot(
    trace: Positional[Path], image: Positional[Path], at: float | None = None, size: tuple[int, int] = (1600, 1000)
) -> None:
    """Take a screenshot of a trace: start a viewer, wait until it has loaded the trace, and save the image.

    Args:
        trace: The trace, a .rrd file.
        image: The .png file to write.
        at: Position of the time cursor on `sim_time`, s; by default the end.
        size: Width and height in pixels.

    Raises:
        RuntimeError: the viewer did not start or did not load the trace; the sentence ends with the cause, or with the
            viewer's last output.
    """
    viewer = Path(rerun_cli.__file__).parent / "rerun"
    port = free_endpoint().rpartition(":")[2]
    with tempfile.TemporaryDirectory() as home:
        environment = {**os.environ, "HOME": home, "XDG_CONFIG_HOME": home, "XDG_DATA_HOME": home}
        subprocess.run([viewer, "analytics", "disable"], env=environment, check=True, capture_output=True)
        options = ["--headless", "--bind", "127.0.0.1", "--port", port, "--window-size", "x".join(map(str, size))]
        with (Path(home) / "log").open("w+") as output:
            process = subprocess.Popen([viewer, *options, trace], env=environment, stdout=output, stderr=output)
            try:
                client = _wait_for_trace(process, f"rerun+http://127.0.0.1:{port}/proxy")
                if at is not None:
                    client.set_time("sim_time", duration=at, play_state="paused")
                time.sleep(SETTLE_S)
                save(client, image)
            except TimeoutError as error:
                output.seek(0)
                raise RuntimeError(f"{error}; {_cause(output.read())}") from None
            finally:
                process.kill()  # it has nothing to save, and an orderly exit is slow on a busy machine
                process.wait()


def _wait_for_trace(process: subprocess.Popen, url: str) -> ViewerClient:
    """Connect to the viewer and wait until it has loaded a recording."""
    deadline = time.monotonic() + LOAD_TIMEOUT_S
    while process.poll() is None and time.monotonic() < deadline:
        time.sleep(0.5)
        try:
            client = ViewerClient.connect(url)
            state = client.get_state()
        except (RuntimeError, ConnectionError):
            continue  # the viewer is still starting
        if state.recordings and state.recordings[0].timelines and not state.loading:
            return client
    if process.poll() is not None:
        raise TimeoutError("the viewer ended before it showed the trace")
    raise TimeoutError(f"the viewer did not show the trace within {LOAD_TIMEOUT_S:g} s")


def save(client: ViewerClient, image: Path) -> None:
    """Save the screenshot. The viewer allows itself 15 s to draw it, which a busy machine may exceed."""
    for _ in range(TRIES - 1):
        with contextlib.suppress(TimeoutError):
            return client.save_screenshot(str(image.resolve()))
    return client.save_screenshot(str(image.resolve()))


def _cause(output: str) -> str:
    if NO_DRIVER in output:
        return "this machine has no graphics driver; install one, on Debian: apt install mesa-vulkan-drivers"
    return f"its last output: {output[-LAST:]}"


if __name__ == "__main__":
    try:
        tyro.cli(take_screenshot)
    except RuntimeError as error:
        sys.exit(f"screenshot: {error}")
