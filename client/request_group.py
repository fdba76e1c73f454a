"""Base class of all groups of requests."""

from client.link import Link
from client.sync_or_async import SyncOrAsync
from protocol.bus.bus import Bus
from protocol.topics import Query, ReplyT, RequestT


class RequestGroup:
    """A connection to a robot, over which any request can be sent."""

    def __init__(self, link: Link) -> None:
        self._link = link

    @property
    def bus(self) -> Bus:
        """The bus of this connection: its session and its liveliness tokens."""
        return self._link.bus

    @SyncOrAsync
    async def ask(self, topic: Query[RequestT, ReplyT], request: RequestT) -> ReplyT:
        """Send any request of `protocol.topics` and return its reply; all other methods use this one."""
        return await self._link.ask(topic, request)
