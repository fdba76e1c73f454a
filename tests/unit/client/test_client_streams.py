"""Streams: iterators over published messages."""

import asyncio
import threading

import pytest
from msgspec.structs import replace

from client import AsyncStream, Refusal, StreamEnded, connect, connect_async, samples, topics
from client.mailboxes import AwaitedMailbox, BlockingMailbox
from client.sync_or_async import run
from protocol import messages as m
from tests.golden.examples import EXAMPLES
from tests.golden.values import SAMPLES, TRAJECTORY
from tools.drill.harness.waiting import PATIENCE_S, eventually


def contact(time: float) -> m.Contact:
    return m.Contact(time=time, bodies=["racket", "ball"], impulse=0.1, ball_velocity=None)


def test_every_publication_is_a_stream(robot, arm):
    for topic in topics.PUBLICATIONS:
        with arm.stream(topic) as stream:
            arm.state()  # once this is answered, the router knows the subscription
            message = EXAMPLES[topic.message.__name__]
            robot.publish(topic, message)
            assert next(stream) == message


def test_the_oldest_are_dropped():
    box = BlockingMailbox[int](3)
    for k in range(10):
        box.put(k)
    assert [run(box.take(timeout=0)) for _ in range(3)] == [7, 8, 9]

    async def awaited() -> list[int]:
        box = AwaitedMailbox[int](3)
        for k in range(10):
            box.put(k)
        await asyncio.sleep(0)
        return [await box.take(timeout=0) for _ in range(3)]

    assert asyncio.run(awaited()) == [7, 8, 9]


def test_a_malformed_message_does_not_end_the_stream(robot, router, arm):
    stream = arm.stream(topics.CONTACT)
    arm.state()
    router.bus.session.put(router.bus.key(topics.CONTACT.key), b"{")
    robot.publish(topics.CONTACT, contact(1.0))
    with pytest.raises(Refusal):
        next(stream)
    assert next(stream).time == 1.0


def test_a_closed_stream_raises_stream_ended(robot, arm):
    stream = arm.stream(topics.CONTACT)
    stream.close()
    stream.close()
    arm.state()
    robot.publish(topics.CONTACT, contact(1.0))
    for _ in range(2):
        with pytest.raises(StreamEnded):
            stream.take(timeout=0.1)


@pytest.mark.parametrize("what", ["the stream", "its connection"])
def test_closing_ends_an_iteration_in_another_thread(robot, what: str):
    """Messages that were published before are still returned."""
    arm = connect(robot.endpoint)
    stream = arm.stream(topics.CONTACT)
    received = []
    thread = threading.Thread(target=lambda: received.extend(message.time for message in stream), daemon=True)
    thread.start()
    arm.state()
    robot.publish(topics.CONTACT, contact(1.0))
    assert eventually(lambda: received == [1.0])
    (stream if what == "the stream" else arm).close()
    thread.join(PATIENCE_S)
    assert not thread.is_alive()
    arm.close()


def test_a_stream_can_be_closed_after_its_connection(robot):
    arm = connect(robot.endpoint)
    with arm.stream(topics.CONTACT) as stream:
        arm.close()
    with pytest.raises(StreamEnded):
        stream.take(timeout=0.1)


def test_ended_streams_and_leases_leave_nothing_behind(arm):
    declared = len(arm.bus._kept)  # noqa: SLF001
    for _ in range(3):
        with arm.stream(topics.CONTACT), arm.lease():
            pass
    assert len(arm.bus._kept) == declared  # noqa: SLF001


def test_an_async_stream_ends_with_its_connection(robot):
    async def receive() -> list[float]:
        async with connect_async(robot.endpoint) as arm:
            stream = arm.stream(topics.CONTACT)
            receiving = asyncio.create_task(_all_of(stream))
            await arm.state()
        return await asyncio.wait_for(receiving, PATIENCE_S)

    assert asyncio.run(receive()) == []


async def _all_of(stream: AsyncStream[m.Contact]) -> list[float]:
    return [message.time async for message in stream]


def test_an_async_stream_can_be_iterated(robot):
    async def receive() -> list[float]:
        async with connect_async(robot.endpoint) as arm, arm.stream(topics.CONTACT, length=2) as stream:
            await arm.state()
            for k in range(3):
                robot.publish(topics.CONTACT, contact(float(k)))
            received = []
            async for message in stream:
                received.append(message.time)
                if message.time == 2.0:
                    break
            with pytest.raises(TimeoutError, match=r"no contact within 0\.05 s"):
                await stream.take(timeout=0.05)
            return received

    received = asyncio.run(receive())
    assert received[-1] == 2.0


def test_samples_are_arrays():
    planned = samples(TRAJECTORY)
    assert planned.positions.tolist() == SAMPLES.tolist()
    assert planned.times.tolist() == pytest.approx([4.25, 4.251, 4.252, 4.253])
    assert planned.hit_index == 2
    reply = EXAMPLES["GoalReply"]
    assert isinstance(reply, m.GoalReply)
    assert samples(replace(reply, trajectory=TRAJECTORY)).times.tolist() == planned.times.tolist()
    with pytest.raises(ValueError, match="ask for it with include_trajectory=True"):
        samples(replace(reply, trajectory=None))
    with pytest.raises(Refusal, match="positions is missing"):
        samples(m.Trajectory(goal_id="g", epoch=1, joint_names=["a"], start_time=0.0, dt=0.001, count=1, hit_index=0))
