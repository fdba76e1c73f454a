"""`python -m tools.screenshot TRACE.rrd OUT.png`: a screenshot of a trace in the viewer, without a display.

It needs a graphics driver, for example Mesa's software rasterizer (Debian: mesa-vulkan-drivers). The viewer of the
Rerun package runs with a temporary home directory, in which its analytics are turned off.
"""

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

LOAD_TIMEOUT_S = 60.0
"""Timeout of the viewer's start and its loading of the trace."""
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
        RuntimeError: the viewer did not start or did not load the trace; the sentence ends with the viewer's last
            output.
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
                client.save_screenshot(str(image.resolve()))
            except TimeoutError as error:
                output.seek(0)
                raise RuntimeError(f"{error}; its last output: {output.read()[-400:]}") from None
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
    raise TimeoutError(f"the viewer did not show the trace within {LOAD_TIMEOUT_S:g} s")


if __name__ == "__main__":
    try:
        tyro.cli(take_screenshot)
    except RuntimeError as error:
        sys.exit(f"screenshot: {error}")
