"""`python -m tools.rally.film TRACE.rrd OUT`: a film (.gif) or a picture (.png) of a rally, from its trace.

MuJoCo renders it without a display, which needs EGL; Mesa's software renderer provides it (Debian: libegl1).
"""

import itertools
import os

os.environ.setdefault("MUJOCO_GL", "egl")  # before MuJoCo is imported, which reads it

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

import mujoco
import numpy as np
import tyro
from PIL import Image

from robot.court import BALL
from robot.description import RobotConfig, load_robot
from robot.model import joint_ids
from services.common.cli import Common, Options
from services.recorder import entities
from tools.trace_reader import SCALARS, Trace, read_trace

CAMERA = {"azimuth": 24.0, "elevation": -21.0, "distance": 5.4}
LOOKS_AT = (1.4, 0.2, 0.8)
"""Point at the centre of the picture, m; the camera is behind the arm and looks across the net."""
PREDICTED, FLOWN, TARGET = (0.47, 0.75, 0.92, 0.9), (0.96, 0.62, 0.26, 0.8), (0.92, 0.35, 0.35, 0.8)
TAIL_S = 0.5
"""Length of the drawn part of the ball's past flight."""
COLOURS = 128
"""Size of a film's palette."""
BALL_COLOUR = (0.78, 0.9, 0.15)
SWATCH = 40
"""Side, pixels, of the squares that add the colours of small objects to a film's palette."""


@dataclass(frozen=True, slots=True)
class Flags:
    """Draw a rally as a film, or as a picture of one moment.

    Attributes:
        trace: The trace, a .rrd file that `volley rally` wrote.
        out: The file to write: .gif, or .png for a picture at `begin`.
        begin: Start of the film on `sim_time`, s.
        end: End of the film on `sim_time`, s; by default 6 s after `begin`.
        fps: Frames a second.
        slow: Ratio of film time to robot time.
        size: Width and height in pixels.
    """

    trace: Annotated[Path, tyro.conf.Positional]
    out: Annotated[Path, tyro.conf.Positional]
    common: Common = field(default_factory=Options)
    begin: float = 0.0
    end: float | None = None
    fps: float = 20.0
    slow: float = 1.0
    size: tuple[int, int] = (560, 350)


class Track:
    """One component of an entity of a trace over time: N times, s, and N rows of values."""

    def __init__(self, trace: Trace, entity: str, component: str) -> None:
        column = trace.column(entity, component)
        rows = [(time, row) for time, row in zip(column.times["sim_time"].tolist(), column.values, strict=True) if row]
        self.times = np.array([time for time, _ in rows]) / 1e9
        self.values = [np.array(row, dtype=float) for _, row in rows]

    def at(self, time: float) -> np.ndarray | None:
        """Return the newest values (K,) at `time`, s, or None before the first."""
        row = int(np.searchsorted(self.times, time, side="right")) - 1
        return self.values[row] if row >= 0 else None

    def between(self, begin: float, end: float) -> np.ndarray:
        """Return the values (n, K) from `begin` to `end`, s."""
        first, last = np.searchsorted(self.times, [begin, end])
        return np.array(self.values[first:last])


class FrameRenderer:
    """Renders moments of a trace."""

    def __init__(self, trace: Trace, config: RobotConfig, size: tuple[int, int]) -> None:
        self._joints = [Track(trace, entities.MEASURED_POSITION.at(name), SCALARS) for name in config.joint_names]
        self._ball = Track(trace, entities.BALL_BODY.path, "Transform3D:translation")
        self._path = Track(trace, entities.PREDICTED_PATH.path, "LineStrips3D:strips")
        self._target = Track(trace, entities.STRIKE_TARGET.path, "Points3D:positions")
        self._model = model = config.load_model(visual=True)
        model.vis.global_.offwidth, model.vis.global_.offheight = size
        self._data = mujoco.MjData(model)
        self._data.qpos[:] = config.pose_at_home
        self._qpos = model.jnt_qposadr[joint_ids(model, config.joint_names)]
        ball = int(model.jnt_qposadr[model.body_jntadr[model.body(BALL).id]])
        self._ball_qpos = slice(ball, ball + 3)
        self._renderer = mujoco.Renderer(model, size[1], size[0])
        self._camera = mujoco.MjvCamera()
        self._camera.lookat[:] = LOOKS_AT
        for name, value in CAMERA.items():
            setattr(self._camera, name, value)

    def draw(self, time: float) -> Image.Image:
        """Return the picture at `time`, s."""
        for address, track in zip(self._qpos, self._joints, strict=True):
            value = track.at(time)
            self._data.qpos[address] = self._data.qpos[address] if value is None else value[0]
        ball = self._ball.at(time)
        if ball is not None:
            self._data.qpos[self._ball_qpos] = ball.reshape(-1, 3)[0]
        mujoco.mj_forward(self._model, self._data)
        self._renderer.update_scene(self._data, self._camera)
        scene = self._renderer.scene
        scene.flags[mujoco.mjtRndFlag.mjRND_SHADOW] = 0  # the net's is a pattern of dots
        self._line(scene, self._ball.between(time - TAIL_S, time).reshape(-1, 3), FLOWN)
        path, target = self._path.at(time), self._target.at(time)
        if path is not None and self._is_new(time):
            self._line(scene, path.reshape(-1, 3), PREDICTED)
        if target is not None:
            _add(scene, mujoco.mjtGeom.mjGEOM_CYLINDER, (0.15, 0.004, 0.0), target.reshape(-1, 3)[0], TARGET)
        return Image.fromarray(self._renderer.render())

    def _is_new(self, time: float) -> bool:
        """Return whether the newest prediction is recent, so that its ball has not arrived."""
        newest = self._path.times[self._path.times <= time][-1]
        return time - newest < 0.15

    def _line(self, scene: mujoco.MjvScene, points: np.ndarray, colour: tuple[float, ...]) -> None:
        for one, other in itertools.pairwise(points):
            geom = _add(scene, mujoco.mjtGeom.mjGEOM_CAPSULE, (0.012, 0.0, 0.0), one, colour)
            if geom is not None and np.linalg.norm(other - one) < 1.0:
                mujoco.mjv_connector(geom, mujoco.mjtGeom.mjGEOM_CAPSULE, 0.012, one, other)


def _add(
    scene: mujoco.MjvScene, kind: int, size: tuple[float, ...], place: np.ndarray, colour: tuple[float, ...]
) -> mujoco.MjvGeom | None:
    if scene.ngeom >= scene.maxgeom:
        return None
    geom = scene.geoms[scene.ngeom]
    mujoco.mjv_initGeom(geom, kind, np.array(size), place, np.eye(3).ravel(), np.array(colour, dtype=np.float32))
    scene.ngeom += 1
    return geom


def frames(renderer: FrameRenderer, flags: Flags) -> Iterator[Image.Image]:
    """Render the frames of the film."""
    end = flags.begin + 6.0 if flags.end is None else flags.end
    for time in np.arange(flags.begin, end, 1 / (flags.fps * flags.slow)):
        yield renderer.draw(float(time))


def palette_of(frame: Image.Image) -> Image.Image:
    """Return a palette for all frames, from one frame and the colours of the drawn objects."""
    swatched = frame.copy()
    for index, colour in enumerate((PREDICTED, FLOWN, TARGET, BALL_COLOUR)):
        for part in range(4):  # from bright to dark
            red, green, blue = (round(255 * value * (1 - part / 6)) for value in colour[:3])
            swatched.paste(
                (red, green, blue), (SWATCH * part, SWATCH * index, SWATCH * (part + 1), SWATCH * (index + 1))
            )
    return swatched.quantize(COLOURS, dither=Image.Dither.NONE)


def main() -> None:
    """Render the film or picture and write the file."""
    flags = tyro.cli(Flags)
    try:
        trace, config = read_trace(flags.trace), load_robot(flags.common.robot_config)
        renderer = FrameRenderer(trace, config, flags.size)
    except (OSError, ValueError, KeyError) as error:
        raise SystemExit(f"volley: {flags.trace} cannot be drawn: {error}") from None
    if flags.out.suffix == ".png":
        renderer.draw(flags.begin).save(flags.out)
        return
    palette = palette_of(renderer.draw(flags.begin))
    first, *rest = (image.quantize(palette=palette, dither=Image.Dither.NONE) for image in frames(renderer, flags))
    first.save(flags.out, save_all=True, append_images=rest, duration=round(1000 / flags.fps), loop=0, optimize=True)


if __name__ == "__main__":
    main()
