"""Contacts of the ball and of the arm; each is reported when it begins and when it ends."""

from dataclasses import dataclass

import mujoco
import numpy as np

from protocol.messages import Contact
from robot.court import BALL, TEE
from robot.model import owner_name
from services.sim.model import Scene

MIN_IMPULSE = 0.01
"""Contacts below this impulse (N·s) are ignored: a settling ball has many. This one turns a ball by 0.2 m/s."""

Bodies = tuple[str, str]
"""Names of both sides of a contact, the ball last, else in alphabetical order."""


@dataclass(slots=True)
class _Episode:
    """A present contact: start (s), impulse so far (N·s), whether it was reported."""

    start_time: float
    impulse: float = 0.0
    reported: bool = False


class ContactLog:
    """Follows contacts from touch to separation. A ball at rest on its tee is no contact."""

    def __init__(self, scene: Scene) -> None:
        self._scene = scene
        self._open: dict[Bodies, _Episode] = {}
        self._force = np.zeros(6)
        names = [owner_name(scene.model, geom) for geom in range(scene.model.ngeom)]
        self._pairs = [[_in_order(first, second) for second in names] for first in names]

    def clear(self) -> None:
        """Drop all present contacts."""
        self._open.clear()

    def update(self, time: float) -> list[Contact]:
        """Add the physics step that began at `time` (s) and has just been taken; return the contacts to report.

        A contact is reported when its impulse exceeds the bound, and again when it ends. Its `time` is the first
        touch; its velocity is the ball's after the contact.
        """
        scene = self._scene
        touching: set[Bodies] = set()
        for index, (first, second) in enumerate(scene.data.contact.geom.tolist()):
            bodies = self._pairs[first][second]
            if bodies == (TEE, BALL):
                continue
            mujoco.mj_contactForce(scene.model, scene.data, index, self._force)
            episode = self._open.setdefault(bodies, _Episode(time))
            episode.impulse += float(np.linalg.norm(self._force[:3])) * scene.model.opt.timestep
            touching.add(bodies)
        return self._begun(touching) + self._ended(touching) if self._open else []

    def _begun(self, touching: set[Bodies]) -> list[Contact]:
        reports = []
        for bodies in sorted(touching):
            episode = self._open[bodies]
            if not episode.reported and episode.impulse >= MIN_IMPULSE:
                episode.reported = True
                reports.append(self._report(bodies, episode, ended=False))
        return reports

    def _ended(self, touching: set[Bodies]) -> list[Contact]:
        ended = {bodies: self._open.pop(bodies) for bodies in self._open.keys() - touching}
        return [self._report(bodies, ended[bodies], ended=True) for bodies in sorted(ended) if ended[bodies].reported]

    def _report(self, bodies: Bodies, episode: _Episode, ended: bool) -> Contact:
        ball = self._scene.ball
        velocity = None
        if ended and ball is not None and BALL in bodies:
            velocity = self._scene.data.qvel[ball.dof : ball.dof + 3].tolist()
        return Contact(
            time=episode.start_time,
            bodies=list(bodies),
            impulse=episode.impulse,
            ball_velocity=velocity,
            ended=ended,
        )


def _in_order(first: str, second: str) -> Bodies:
    first, second = sorted((first, second))
    return (second, first) if first == BALL else (first, second)
