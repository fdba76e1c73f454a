"""Choice of the arm's setpoint: the newest command's, a repeated one, or the brake's."""

import numpy as np

from protocol import messages as m
from protocol.codec import bad_message, check_lengths
from robot.description import RobotConfig
from services.common.robot_side.backend import Setpoint
from services.common.robot_side.brake import Brake

NEVER = -1
MAX_ACCELERATION = 1e6
"""Largest commanded acceleration, rad/s²; commands beyond it are refused."""


class Drive:
    """Chooses the arm's setpoint at each tick.

    Before the first command of a run the arm holds its pose. Later, a tick without a fresh command repeats the last
    acceleration. After `silence_ticks` such ticks in a row the brake takes over, until the arm is at rest and a
    command's reference is at rest close to it.
    """

    def __init__(self, config: RobotConfig) -> None:
        self._config = config
        self.begin(0, config.home)

    def begin(self, run: int, positions: np.ndarray) -> None:
        """Start a run with the arm at rest at `positions` (J,), rad."""
        self.run = run
        self.brake = False
        self.applied_tick = NEVER
        self.answered_tick = NEVER
        self._fresh: m.Command | None = None
        self._silent = 0
        self._ready = True
        still = np.zeros(self._config.joint_count)
        self._setpoint = Setpoint(still, positions, still, still)
        self._brake = Brake(self._config, positions)

    def take(self, command: m.Command, tick: int) -> None:
        """Store `command` for the coming tick.

        A command that answers a tick `silence_ticks` ago or earlier is refused: an arm with such a delay must brake.

        Raises:
            Refusal: `bad_message` for a command that is old, of another run, of wrong length, or beyond any arm.
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
            feedforward=command.accelerations if command.feedforward is None else command.feedforward,
        )
        if command.next is not None:
            check_lengths(
                self._config.joint_count, positions=command.next.positions, velocities=command.next.velocities
            )
        largest = max(map(abs, command.accelerations))
        if largest > MAX_ACCELERATION:
            sentence = f"it wants {largest:.3g} rad/s²; no arm does more than {MAX_ACCELERATION:.0e}"
            raise bad_message("accelerations", sentence)
        self.answered_tick = command.tick
        self._fresh = command

    def lose(self) -> None:
        """Drop the command for the coming tick."""
        self._fresh = None

    def note_ready(self, ready: bool, positions: np.ndarray, velocities: np.ndarray) -> None:
        """Store whether the arm follows setpoints; when it begins to, the brake starts from its measured state.

        positions, velocities: (J,), rad, rad/s. Others may have moved the arm away from where the brake held it.
        """
        if ready and not self._ready:
            self._brake.engage(positions, velocities, np.zeros_like(velocities))
        self._ready = ready

    @property
    def accelerations(self) -> np.ndarray | None:
        """Accelerations (J,) of the newest setpoint, rad/s²; None if the arm did not follow it."""
        return self._setpoint.accelerations if self._ready else None

    @property
    def accelerates(self) -> bool:
        """Whether the reference accelerates by more than the jerk limit allows to drop in one tick."""
        most = self._config.limits.jerks * self._config.tick
        return bool(np.any(np.abs(self._setpoint.feedforward) > most))

    @property
    def brake_reason(self) -> str:
        """The reason of braking, in words."""
        return f"no command for {self._config.silence_ticks} ticks"

    def setpoint(self, positions: np.ndarray, velocities: np.ndarray) -> Setpoint:
        """Return the setpoint of the coming tick for the measured state (J,), rad, rad/s."""
        command, self._fresh = self._fresh, None
        if command is None:
            self._miss(positions, velocities)
        else:
            self._apply(command)
        if self.brake or self.applied_tick == NEVER:
            self._setpoint = self._brake.setpoint(positions, velocities)
        return self._setpoint

    def _apply(self, command: m.Command) -> None:
        self._silent = 0
        self.applied_tick = command.tick
        if self.brake and self._brake.releases(np.array(command.positions), np.array(command.velocities)):
            self.brake = False
        if not self.brake:
            self._setpoint = setpoint_of(command, self._config.tick)

    def _miss(self, positions: np.ndarray, velocities: np.ndarray) -> None:
        if self.applied_tick == NEVER or self.brake:
            return
        self._silent += 1
        if self._silent >= self._config.silence_ticks:
            self.brake = True
            self._brake.engage(positions, velocities, self._setpoint.accelerations)
        else:
            self._setpoint = self._setpoint.continued(self._config.tick)


def setpoint_of(command: m.Command, tick: float) -> Setpoint:
    """Return the setpoint of `command` for the coming tick, `tick` s long.

    An older controller does not send the next reference; then it is integrated from the accelerations.
    """
    accelerations = np.array(command.accelerations)
    feedforward = accelerations if command.feedforward is None else np.array(command.feedforward)
    if command.next is not None:
        ahead = np.array(command.next.positions), np.array(command.next.velocities)
        return Setpoint(accelerations, *ahead, feedforward)
    here = np.array(command.positions), np.array(command.velocities)
    return Setpoint(accelerations, *here, feedforward).continued(tick)
