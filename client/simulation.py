"""Requests that only a simulated arm takes."""

from __future__ import annotations

from typing import Any, Literal

from client.asking import Asking
from client.fields import Vector, triple
from client.twofold import Twofold
from protocol import messages as m
from protocol import topics


class SimulationRequests(Asking):
    """What can be asked of a simulation besides."""

    @Twofold
    async def step(self, ticks: int = 1) -> m.Stepped:
        """Advance the stepped clock.

        Args:
            ticks: 1 to 10000.
        """
        return await self._link.ask(topics.SIM_STEP, m.Step(ticks=ticks))

    @Twofold
    async def reset_sim(
        self, positions: Vector | None = None, ball: m.Ball | None = None, seed: int = 0
    ) -> m.ResetDone:
        """Begin a new run of the simulated arm: at rest, the clock at 0.

        Args:
            positions: Where the arm begins, rad a joint; by default home.
            ball: Where the ball begins; by default on its tee.
            seed: Of the sensor noise; names the run where the clock is stepped.
        """
        return await self._link.ask(topics.SIM_RESET, m.Reset(positions=_listed(positions), ball=ball, seed=seed))

    @Twofold
    async def throw(self, position: Vector, velocity: Vector, spin: Vector | None = None) -> m.Thrown:
        """Put the simulated ball in flight, in the run that goes on.

        Args:
            position: (3,), m, in the world frame.
            velocity: (3,), m/s.
            spin: Angular velocity (3,), rad/s; by default none.

        Raises:
            ValueError: a vector has not three numbers.
        """
        turning = None if spin is None else triple("spin", spin)
        throw = m.Throw(position=triple("position", position), velocity=triple("velocity", velocity), spin=turning)
        return await self._link.ask(topics.SIM_BALL, throw)

    @Twofold
    async def disturb(
        self,
        kind: Literal["acceleration", "torque", "sensor_noise", "ball_noise", "wind", "loss"],
        *,
        values: Vector | None = None,
        start_time: float | None = None,
        duration: float | None = None,
        position_std: float | None = None,
        velocity_std: float | None = None,
        stream: Literal["state", "command"] | None = None,
        latency_s: float | None = None,
        drop_rate: float | None = None,
    ) -> m.Disturbed:
        """Push the simulated arm, blur its sensors or the sight of the ball, let wind blow, or lose messages.

        Args:
            kind: A push by `acceleration` or `torque` needs values and duration; `sensor_noise` both standard
                deviations; `ball_noise` the first, the latency and the drop rate; `wind` values; `loss` stream and
                duration.
            values: On each joint, rad/s² or N·m; of the wind along the axes of the world, m/s.
            start_time: When a push begins, s on the robot's clock; by default now.
            duration: Of a push or a loss, s.
            position_std: Standard deviation of measured positions, rad; of the ball's, m.
            velocity_std: Standard deviation of measured velocities, rad/s.
            stream: Whose messages are lost.
            latency_s: From a sight of the ball to its message, s.
            drop_rate: Part of the sights of the ball that are lost, 0 to 1.
        """
        push = {"values": _listed(values), "start_time": start_time, "duration": duration}
        noise = {"position_std": position_std, "velocity_std": velocity_std}
        noise |= {"latency_s": latency_s, "drop_rate": drop_rate}
        request: dict[str, Any] = {"kind": kind, **push, **noise, "stream": stream}
        return await self._link.ask(topics.SIM_DISTURB, m.Disturb(**request))


def _listed(values: Vector | None) -> list[float] | None:
    return None if values is None else list(values)
