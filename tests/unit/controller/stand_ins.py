"""Substitutes for Zenoh, the arm and the clock in tests of the controller's parts."""

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np
from msgspec import structs

from protocol import messages as m
from protocol import topics
from protocol.bus.queues import Inbox, Stream
from protocol.codec import encode, matrix_bytes
from protocol.errors import Refusal
from robot.description import RobotConfig, load_robot
from tests.golden.examples import EXAMPLES

CONFIG = load_robot()
NOISE = b"\xc1" * 100
NS = 1_000_000_000


class FakeClock:
    """A monotonic clock, ns, that a test moves; each look at it moves it by `creep_ns`."""

    def __init__(self) -> None:
        self.now_ns = NS
        self.creep_ns = 0

    def __call__(self) -> int:
        """Return the time."""
        self.now_ns += self.creep_ns
        return self.now_ns

    def pass_by(self, seconds: float) -> None:
        """Let time pass."""
        self.now_ns += round(seconds * NS)


class FakePublisher:
    """Keeps what is published in the list of its topic."""

    def __init__(self, messages: list[Any]) -> None:
        self.put = messages.append


class Body(bytes):
    """The payload of a sample."""

    def to_bytes(self) -> bytes:
        """Return it as Zenoh does."""
        return bytes(self)


class FakeBus:
    """A bus without a session that keeps what is declared, published and asked."""

    def __init__(self) -> None:
        self.published: dict[str, list[Any]] = {}
        self.blocking: dict[str, bool] = {}
        self.asked: list[tuple[str, Callable[[bytes], object]]] = []
        self.inboxes: dict[str, Inbox[Any]] = {}
        self.watches: dict[str, Callable[[str, bool], object]] = {}
        self.streams: dict[str, Stream] = {}
        self.listeners: dict[str, Callable[[bytes], object]] = {}
        self.puts: list[str] = []

    def publisher(self, topic: topics.Publication, blocking: bool = False) -> FakePublisher:
        """Return a publisher; all of one topic share a list."""
        self.blocking[topic.key] = blocking
        return FakePublisher(self.published.setdefault(topic.key, []))

    def ask_later(self, topic: topics.Query, _: object, callback: Callable[[bytes], object]) -> None:
        """Keep the callback of a question."""
        self.asked.append((topic.key, callback))

    def serve(self, topic: topics.Query, inbox: Inbox[Any]) -> None:
        """Keep the inbox of a topic's requests."""
        self.inboxes[topic.key] = inbox

    def stream(self, topic: topics.Publication, stream: Stream) -> None:
        """Keep the queue of a stream."""
        self.streams[topic.key] = stream

    def listen(self, topic: topics.Publication, callback: Callable[[bytes], object]) -> None:
        """Keep the callback of a subscription."""
        self.listeners[topic.key] = callback

    def watch_alive(self, key: str, callback: Callable[[str, bool], object]) -> None:
        """Keep the callback that watches a token."""
        self.watches[key] = callback

    def announce(self, service: str) -> None:
        """Do nothing."""

    def take_puts(self) -> list[str]:
        """Return what was put."""
        puts, self.puts = self.puts, []
        return puts

    # --- the other side of the bus, for tests ---

    def send(self, body: bytes) -> None:
        """Publish a state as the arm does."""
        self.streams["state"].callback(SimpleNamespace(payload=Body(body)))  # type: ignore[operator]

    def see_arm(self, alive: bool = True) -> None:
        """Report that the arm's token appeared or disappeared."""
        self.watches["alive/sim"]("volley/arm/alive/sim", alive)

    def see_client(self, client: str, alive: bool = True) -> None:
        """Report that a client's token appeared or disappeared."""
        self.watches["alive/client/*"](f"volley/arm/alive/client/{client}", alive)

    def request(self, topic: topics.Query, request: Any) -> "Request":
        """Send a request to its owner."""
        sent = Request(topic, request)
        assert self.inboxes[topic.key].offer(sent)
        return sent


class Request:
    """A request that keeps its answer."""

    def __init__(self, topic: topics.Query, request: Any, answered: list[str] | None = None) -> None:
        self.topic = topic
        self.request = request
        self.answer: Any = None
        self.answered = answered if answered is not None else []

    def decode(self) -> Any:
        """Return the request."""
        if isinstance(self.request, Refusal):
            raise self.request
        return self.request

    def reply(self, answer: Any) -> None:
        """Keep the answer."""
        self.answer = answer
        self.answered.append(self.topic.key)

    refuse = reply


def state(tick: int, **changes: Any) -> m.State:
    """Return the state of an arm at rest at home."""
    home, still = CONFIG.home.tolist(), [0.0] * CONFIG.joint_count
    at_rest = m.State(
        run=1,
        tick=tick,
        time=tick / 1000,
        positions=home,
        velocities=still,
        torques=still,
        saturated=[False] * CONFIG.joint_count,
        brake=False,
        applied_tick=tick - 1,
        accelerations=still,
    )
    return structs.replace(at_rest, **changes)


def description(clock: m.Clock, config: RobotConfig = CONFIG, **changes: Any) -> bytes:
    """Return how the arm of `config` describes itself."""
    names = list(config.joint_names)
    ours = structs.replace(EXAMPLES["Description"], joint_names=names, rate_hz=config.rate_hz, clock=clock)
    return encode(structs.replace(ours, **changes))


def staying(start: int, epoch: int, goal_id: str = "goal", config: RobotConfig = CONFIG) -> m.Trajectory:
    """Return a trajectory of five samples from tick `start` on that stays at home, its hit in the middle."""
    home = config.home[None, :].repeat(5, axis=0)
    still = matrix_bytes(np.zeros_like(home))
    return m.Trajectory(
        goal_id=goal_id, epoch=epoch, joint_names=list(config.joint_names), start_time=start * config.tick,
        dt=config.tick, count=5, hit_index=2, positions=matrix_bytes(home), velocities=still, accelerations=still,
        stamps=m.Stamps(requested=1, planned=2),
    )  # fmt: skip
