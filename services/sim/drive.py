"""Which acceleration the arm gets: the command's, the last one's for a while, or its own brake's."""

import math

import numpy as np

from protocol import messages as m
from protocol.codec import bad_message, check_lengths
from robot.description import RobotConfig
from services.sim.brake import Brake

NEVER = -1
MAX_ACCELERATION = 1e6
"""rad/s²; a command beyond it is none that a controller meant."""


class Drive:
    """Decides tick by tick what the arm applies.

    Before the first command of a run the arm holds its pose. Later, a tick without a fresh command repeats the last
    acceleration; from the `silence_ticks`th of them in a row the brake has the arm, until it rests and a command's
    reference rests close by.
    """

    def __init__(self, config: RobotConfig) -> None:
        self._config = config
        self.begin(0, config.home)

    def begin(self, run: int, positions: np.ndarray) -> None:
        """Begin a run with the arm at rest at `positions` (J,), rad."""
        self.run = run
        self.brake = False
        self.applied_tick = NEVER
        self.answered_tick = NEVER
        self._fresh: m.Command | None = None
        self._silent = 0
        self._acceleration = np.zeros(self._config.joint_count)
        self._brake = Brake(self._config, positions)

    def take(self, command: m.Command, tick: int) -> None:
        """Keep `command` for the coming tick.

        What answers a tick `silence_ticks` ago is no sign of life: an arm that is led so far behind has to brake.

        Raises:
            Refusal: `bad_message` where it is no news, of another run, of wrong length, or beyond any arm.
        """
        oldest = max(self.answered_tick, tick - self._config.silence_ticks) + 1
        if command.run != self.run:
            raise bad_message("run", f"it is for run {command.run}; this is run {self.run}")
        if not oldest <= command.tick <= tick:
            due = f"an answer to {oldest} … {tick} is news" if oldest <= tick else "the newest is answered"
            raise bad_message("tick", f"it answers tick {command.tick}; {due}")
        check_lengths(
            self._config.joint_count,
            accelerations=command.accelerations,
            positions=command.positions,
            velocities=command.velocities,
        )
        largest = max(map(abs, command.accelerations))
        if largest > MAX_ACCELERATION:
            sentence = f"it wants {largest:.3g} rad/s²; no arm does more than {MAX_ACCELERATION:.0e}"
            raise bad_message("accelerations", sentence)
        self.answered_tick = command.tick
        self._fresh = command

    def lose(self) -> None:
        """Drop the command that was kept for the coming tick."""
        self._fresh = None

    def acceleration(self, positions: np.ndarray, velocities: np.ndarray) -> np.ndarray:
        """Return the acceleration (J,), rad/s², for the coming tick from the measured state."""
        command, self._fresh = self._fresh, None
        if command is None:
            self._miss(positions, velocities)
        else:
            self._hear(command)
        if self.brake or self.applied_tick == NEVER:
            self._acceleration = self._brake.acceleration(positions, velocities)
        return self._acceleration

    def _hear(self, command: m.Command) -> None:
        self._silent = 0
        self.applied_tick = command.tick
        if self.brake and self._brake.releases(np.array(command.positions), np.array(command.velocities)):
            self.brake = False
        if not self.brake:
            self._acceleration = np.array(command.accelerations)

    def _miss(self, positions: np.ndarray, velocities: np.ndarray) -> None:
        if self.applied_tick == NEVER or self.brake:
            return
        self._silent += 1
        if self._silent >= self._config.silence_ticks:
            self.brake = True
            self._brake.engage(positions, velocities, self._acceleration)


class Loss:
    """Windows of ticks in which the messages of a stream are lost."""

    def __init__(self, rate_hz: float) -> None:
        self._rate_hz = rate_hz
        self._windows: dict[str, tuple[int, int]] = {}

    def begin(self, stream: str, duration: float, tick: int) -> None:
        """Lose the messages of the ticks from `tick` on, for `duration` s."""
        self._windows[stream] = tick, tick + math.ceil(duration * self._rate_hz - 1e-9)

    def clear(self) -> None:
        """Lose nothing any more."""
        self._windows.clear()

    def has(self, stream: str, tick: int) -> bool:
        """Return whether the message of `tick` on `stream` is lost."""
        first, end = self._windows.get(stream, (0, 0))
        return first <= tick < end

    def describe(self, tick: int) -> list[m.ActiveDisturbance]:
        """Return the losses that act at `tick`, as published."""
        return [
            m.ActiveDisturbance(kind="loss", stream=stream, end_time=end / self._rate_hz)
            for stream, (first, end) in self._windows.items()
            if first <= tick < end
        ]
