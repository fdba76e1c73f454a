"""Streams: iterators over what is published."""

import asyncio

import pytest

from client import Refusal, connect_async, samples, topics
from client.waiting import AwaitedMailbox, BlockingMailbox, run
from protocol import messages as m
from tests.golden.examples import EXAMPLES, SAMPLES, TRAJECTORY


def contact(time: float) -> m.Contact:
    return m.Contact(time=time, bodies=["racket", "ball"], impulse=0.1, ball_velocity=None)


def test_every_publication_is_a_stream(robot, arm):
    for topic in topics.PUBLICATIONS:
        with arm.stream(topic) as stream:
            arm.state()  # an answer comes behind the subscription
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


def test_a_malformed_message_ends_no_stream(robot, router, arm):
    stream = arm.stream(topics.CONTACT)
    arm.state()
    router.bus.session.put(router.bus.key(topics.CONTACT.key), b"{")
    robot.publish(topics.CONTACT, contact(1.0))
    with pytest.raises(Refusal):
        next(stream)
    assert next(stream).time == 1.0


def test_a_closed_stream_hears_nothing(robot, arm):
    stream = arm.stream(topics.CONTACT)
    stream.close()
    stream.close()
    arm.state()
    robot.publish(topics.CONTACT, contact(1.0))
    with pytest.raises(TimeoutError):
        stream.take(timeout=0.1)


def test_the_twin_iterates_too(robot):
    async def hear() -> list[float]:
        async with connect_async(robot.endpoint) as arm, arm.stream(topics.CONTACT, length=2) as stream:
            await arm.state()
            for k in range(3):
                robot.publish(topics.CONTACT, contact(float(k)))
            heard = []
            async for message in stream:
                heard.append(message.time)
                if message.time == 2.0:
                    break
            with pytest.raises(TimeoutError):
                await stream.take(timeout=0.05)
            return heard

    heard = asyncio.run(hear())
    assert heard[-1] == 2.0


def test_samples_are_arrays():
    planned = samples(TRAJECTORY)
    assert planned.positions.tolist() == SAMPLES.tolist()
    assert planned.times.tolist() == pytest.approx([4.25, 4.251, 4.252, 4.253])
    assert planned.hit_index == 2
    with pytest.raises(Refusal, match="positions is missing"):
        samples(m.Trajectory(goal_id="g", epoch=1, joint_names=["a"], start_time=0.0, dt=0.001, count=1, hit_index=0))
