"""Requests to a simulated arm."""

from __future__ import annotations

from typing import Any, Literal

from client.fields import Vector, triple
from client.request_group import RequestGroup
from client.sync_or_async import SyncOrAsync
from protocol import messages as m
from protocol import topics


class SimulationRequests(RequestGroup):
    """Requests that only a simulated arm accepts."""

    @SyncOrAsync
    async def step(self, ticks: int = 1) -> m.Stepped:
        """Advance the stepped clock.

        Args:
            ticks: Number of ticks, 1 to 10000.
        """
        return await self._link.ask(topics.SIM_STEP, m.Step(ticks=ticks))

    @SyncOrAsync
    async def reset_sim(
        self, positions: Vector | None = None, ball: m.Ball | None = None, seed: int = 0
    ) -> m.ResetDone:
        """Start a new run of the simulated arm: at rest, the clock at 0.

        Args:
            positions: Initial joint positions (J,), rad; by default home.
            ball: Initial state of the ball; by default at rest on its tee.
            seed: Seed of the sensor noise; with the stepped clock also the number of the run.
        """
        return await self._link.ask(topics.SIM_RESET, m.Reset(positions=_listed(positions), ball=ball, seed=seed))

    @SyncOrAsync
    async def throw(self, position: Vector, velocity: Vector, spin: Vector | None = None) -> m.Thrown:
        """Throw the simulated ball, in the present run.

        Args:
            position: (3,), m, in the world frame.
            velocity: (3,), m/s.
            spin: Angular velocity (3,), rad/s; by default none.

        Raises:
            ValueError: a vector does not have three numbers.
        """
        turning = None if spin is None else triple("spin", spin)
        throw = m.Throw(position=triple("position", position), velocity=triple("velocity", velocity), spin=turning)
        return await self._link.ask(topics.SIM_BALL, throw)

    @SyncOrAsync
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
        """Push the simulated arm, add noise to its sensors or to the measured ball, add wind, or drop messages.

        Args:
            kind: `acceleration` and `torque`, which push the arm, need values and duration; `sensor_noise` needs both
                standard deviations; `ball_noise` position_std, latency_s and drop_rate; `wind` values; `loss` stream
                and duration.
            values: Push on each joint, rad/s² or N·m; or wind along the axes of the world, m/s.
            start_time: Start of the push, s on the robot's clock; by default now.
            duration: Duration of the push or the loss, s.
            position_std: Standard deviation of measured joint positions, rad, or of the ball's, m.
            velocity_std: Standard deviation of measured joint velocities, rad/s.
            stream: Stream whose messages are dropped.
            latency_s: Delay of the ball's measurements, s.
            drop_rate: Fraction of the ball's measurements that are dropped, 0 to 1.
        """
        push = {"values": _listed(values), "start_time": start_time, "duration": duration}
        noise = {"position_std": position_std, "velocity_std": velocity_std}
        noise |= {"latency_s": latency_s, "drop_rate": drop_rate}
        request: dict[str, Any] = {"kind": kind, **push, **noise, "stream": stream}
        return await self._link.ask(topics.SIM_DISTURB, m.Disturb(**request))


def _listed(values: Vector | None) -> list[float] | None:
    return None if values is None else list(values)
