"""Requests of the striker."""

from __future__ import annotations

from collections.abc import Sequence

from client.asking import Asking
from client.fields import Vector, triple
from client.twofold import Twofold
from protocol import messages as m
from protocol import topics


class StrikingRequests(Asking):
    """What can be asked of the striker."""

    @Twofold
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
        """Let the striker return every ball that comes within reach; `stream(topics.STRIKES)` says what it does.

        A further call replaces the one before; for a ball on its way it moves the target.

        Args:
            target: Where the balls shall land, (3,), m, in the world frame.
            flight_time: From the touch to the landing, s; by default the striker chooses it.
            count: Balls to strike at; by default without end.
            primitives: Those that may be imitated; by default any of the library.
            revise_hz: Corrections a second while the arm swings; 0: none.
            until_s: Time before the touch after which nothing is corrected, s.

        Raises:
            ValueError: the target has not three numbers.
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

    @Twofold
    async def stop_striking(self) -> m.Striking:
        """Strike at no further ball; a motion under way is played to its end."""
        return await self._link.ask(topics.STRIKE_STOP, m.Empty())
