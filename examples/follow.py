"""Wait for a goal and print its progress at the same time, with the asynchronous client library.

    volley up                              # in another shell
    python examples/follow.py [ENDPOINT]

`connect_async` offers the methods of `connect` as coroutines; streams are asynchronous iterators.
"""

import asyncio
import sys

from client import AsyncArm, connect_async, topics

EVERY = 10
"""Statuses for each printed line; 50 arrive in a second."""


async def print_progress(arm: AsyncArm) -> None:
    """Print every tenth status, until cancelled."""
    received = 0
    async with arm.stream(topics.STATUS) as statuses:
        async for status in statuses:
            received += 1
            if received % EVERY == 0:
                worst = max(map(abs, status.error.positions))
                print(f"{status.time:8.3f} s  {status.mode:8}  off the reference by {worst:.1e} rad")


async def follow(endpoint: str | None = None) -> None:
    """Play a goal, and print its progress until it has ended."""
    async with connect_async(endpoint) as arm:
        progress = asyncio.create_task(print_progress(arm))
        goal = await arm.goal("forehand", duration=1.5)
        result = await goal.wait()
        progress.cancel()
        print(f"{result.outcome} after a peak error of {result.peak_tracking_error:.1e} rad")


def main(endpoint: str | None = None) -> None:
    """Run it."""
    asyncio.run(follow(endpoint))


if __name__ == "__main__":
    main(*sys.argv[1:])
