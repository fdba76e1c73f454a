"""Requests to the striker."""

from __future__ import annotations

from collections.abc import Sequence

from client.fields import Vector, triple
from client.request_group import RequestGroup
from client.sync_or_async import SyncOrAsync
from protocol import messages as m
from protocol import topics


class StrikingRequests(RequestGroup):
    """Requests that the striker answers."""

    @SyncOrAsync
    async def strike(
        self,
        target: Vector,
        *,
        flight_time: float | None = None,
        count: int | None = None,
        primitives: Sequence[str] | None = None,
        revise_hz: float = 50.0,
        until_s: float = 0.05,
    ) -> m.Striking:
        """Let the striker return every ball that comes within reach; `stream(topics.STRIKES)` reports its decisions.

        Each call replaces the last one, and moves the target of a ball in flight.

        Args:
            target: Where the balls must land, (3,), m, in the world frame.
            flight_time: Time from the touch to the landing, s; by default the striker chooses it.
            count: Number of balls to return; by default unlimited.
            primitives: Primitives that may be imitated; by default all of the library.
            revise_hz: Rate of corrections during the swing, Hz; 0: none.
            until_s: No corrections later than this time before the touch, s.

        Raises:
            ValueError: the target does not have three numbers.
        """
        request = m.StrikeRequest(
            target=triple("target", target),
            flight_time=flight_time,
            count=count,
            primitives=None if primitives is None else list(primitives),
            revise_hz=revise_hz,
            until_s=until_s,
        )
        return await self._link.ask(topics.STRIKE, request)

    @SyncOrAsync
    async def stop_striking(self) -> m.Striking:
        """Stop returning balls; a running motion is played to its end."""
        return await self._link.ask(topics.STRIKE_STOP, m.Empty())
