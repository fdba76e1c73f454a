"""Every line of the permission table is tested over TLS, both ways, and so is who may not connect at all.

The tests show without waiting that a refused message does not arrive. Zenoh delivers in order: once the router has
answered the sender of the refused message, and a permitted message that was sent afterwards has arrived, the refused
one would have arrived before it.
"""

import logging
import threading
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from queue import SimpleQueue
from typing import Any

import msgpack
import pytest
import zenoh
from cell import STRANGERS, SecureCell
from harness import PATIENCE_S, ROBOT, SERVICES, Stack, wait_for_controller

from deploy.zenoh.configure import client_config
from deploy.zenoh.permissions import ROLES, acting, reading
from protocol import messages as m
from protocol import topics
from protocol.bus.bus import Bus
from protocol.bus.sessions import open_session
from protocol.errors import NoAnswer
from services.common.cli import Options
from services.common.single_instance import Outcome, SingleInstance
from services.common.supervisor import Supervisor, command_lines
from tests.cores import LOOP_CORE

ALSO = ("striker",)
LOG = logging.getLogger("test")
HOME = ROBOT.home.tolist()
BY_NAME = {role.name: role for role in ROLES}
EVERYBODY = pytest.mark.parametrize("who", [*BY_NAME, *STRANGERS])
TOKENS = ("client/shell", *(f"{name}{claim}" for name in (*SERVICES, "recorder", "striker") for claim in ("", "/2a")))


def may(who: str, message: str, key: str) -> bool:
    """Return whether the table lets `who` send `message` on `key`; a stranger may send nothing."""
    if who not in BY_NAME:
        return False
    granted = [p.keys for p in (*reading(), *acting(BY_NAME[who])) if message in p.messages]
    return any(zenoh.KeyExpr(k).includes(zenoh.KeyExpr(key)) for keys in granted for k in keys)


class Participants:
    """Sessions on one bus: those of the owners, who answer b"owner" to all their requests, and others on demand."""

    def __init__(self, cell: SecureCell, stack: ExitStack) -> None:
        self._cell = cell
        self._stack = stack
        self._joined: dict[tuple[str, str], Bus] = {}
        self.arrived: SimpleQueue[tuple[str, bytes]] = SimpleQueue()
        self.heard: SimpleQueue[tuple[str, bytes]] = SimpleQueue()
        self._declared: list[Any] = []
        for topic in topics.QUERIES:
            key = self.owner(topic).key(topic.key)
            self._declared.append(self.owner(topic).session.declare_queryable(key, self._answer, complete=True))
        for topic in topics.PUBLICATIONS:
            ear = self.bus("viewer", "ear")
            self._declared.append(ear.session.declare_subscriber(ear.key(topic.key), self._hear))
        fence(self.bus("viewer", "ear"))

    def bus(self, who: str, purpose: str) -> Bus:
        """Return the session of `who` for a purpose; messages between two sessions pass the router."""
        if (who, purpose) not in self._joined:
            self._joined[who, purpose] = self._stack.enter_context(self._cell.join(who))
        return self._joined[who, purpose]

    def owner(self, topic: topics.Query | topics.Publication) -> Bus:
        """Return the session that owns `topic`."""
        return self.bus(topic.owner, "owner")

    def asker(self, topic: topics.Query) -> Bus:
        """Return a session that may send requests of `topic`."""
        return self.bus(next(role for role in ("planner", "tester") if may(role, "query", topic.key)), "ask")

    def publish(self, topic: topics.Publication, body: bytes) -> None:
        """Publish as the owner; return once the router has sent the message to every subscriber."""
        owner = self.owner(topic)
        owner.session.put(owner.key(topic.key), body)
        assert up_to(self.heard, (owner.key(topic.key), body)) == []
        fence(owner)  # one subscriber may have received it before the router has sent it to all

    def _answer(self, query: zenoh.Query) -> None:
        self.arrived.put((str(query.key_expr), query.payload.to_bytes() if query.payload else b""))
        with query:
            query.reply(query.key_expr, b"owner")

    def _hear(self, sample: zenoh.Sample) -> None:
        body = b"deleted" if sample.kind == zenoh.SampleKind.DELETE else sample.payload.to_bytes()
        self.heard.put((str(sample.key_expr), body))


def fence(bus: Bus) -> None:
    """Return once the router has handled everything that `bus` sent before."""
    for topic in (
        topics.STATUS_QUERY,
        topics.DESCRIPTION,
    ):  # the sender may be the owner of one; the other one passes the router
        list(bus.session.get(bus.key(topic.key), payload=b"fence", timeout=PATIENCE_S))


def at_once(callback: Callable[[zenoh.Sample], object]) -> zenoh.handlers.Callback:
    """Run `callback` in Zenoh's own thread: when a fence is answered, the callback has run."""
    return zenoh.handlers.Callback(callback, indirect=False)


def replies(bus: Bus, key: str, body: bytes) -> list[bytes]:
    """Send a request to everybody who answers on `key` and return their replies, sorted."""
    answers = bus.session.get(
        key,
        payload=body,
        target=zenoh.QueryTarget.ALL,
        consolidation=zenoh.ConsolidationMode.NONE,
        timeout=PATIENCE_S,
    )
    return sorted(reply.ok.payload.to_bytes() for reply in answers if reply.ok is not None)


def up_to(queue: SimpleQueue[tuple[str, bytes]], last: tuple[str, bytes]) -> list[tuple[str, bytes]]:
    """Return what is in the queue before `last`, which must arrive; fences are left out."""
    taken = []
    while (item := queue.get(timeout=PATIENCE_S)) != last:
        if item[1] != b"fence":
            taken.append(item)
    return taken


@pytest.fixture(scope="module")
def cell(tmp_path_factory: pytest.TempPathFactory) -> SecureCell:
    """Write certificates and configurations."""
    return SecureCell(tmp_path_factory.mktemp("cell"))


@pytest.fixture(scope="module")
def people(cell: SecureCell) -> Iterator[Participants]:
    """Yield a bus with the permission table, and every participant on it."""
    with ExitStack() as stack:
        stack.enter_context(cell.host())
        yield Participants(cell, stack)


@EVERYBODY
def test_publishing(people: Participants, who: str):
    """Only the owner's messages arrive; nobody can delete, and a wildcard reaches nobody."""
    sender = people.bus(who, "act")
    for topic in topics.PUBLICATIONS:
        key = sender.key(topic.key)
        sender.session.put(key, who.encode())
        sender.session.delete(key)
        sender.session.put(f"{key[:-1]}$*", b"wildcard")
        fence(sender)
        people.owner(topic).session.put(key, b"last")
        expected = [(key, who.encode())] if may(who, "put", topic.key) else []
        assert up_to(people.heard, (key, b"last")) == expected, topic.key


@EVERYBODY
def test_subscribing(people: Participants, who: str):
    """Every role receives every publication once, a stranger none."""
    listener = people.bus(who, "listen")
    got: SimpleQueue[bytes] = SimpleQueue()
    for topic in topics.PUBLICATIONS:
        key = listener.key(topic.key)
        subscriber = listener.session.declare_subscriber(
            key, at_once(lambda sample: got.put(sample.payload.to_bytes()))
        )
        fence(listener)
        people.publish(topic, b"news")
        fence(listener)
        subscriber.undeclare()
        assert got.qsize() == may(who, "declare_subscriber", topic.key), topic.key
        while not got.empty():
            assert got.get() == b"news"


@EVERYBODY
@pytest.mark.parametrize("wide", ["**", "volley/**", "volley/arm/**", "volley/arm/*"])
def test_eavesdropping(people: Participants, who: str, wide: str):
    """A subscription to more than the table's keys receives nothing."""
    listener = people.bus(who, "listen")
    got: SimpleQueue[bytes] = SimpleQueue()
    subscriber = listener.session.declare_subscriber(wide, at_once(lambda sample: got.put(sample.payload.to_bytes())))
    fence(listener)
    people.publish(topics.STATE, b"news")
    fence(listener)
    subscriber.undeclare()
    assert got.empty()


@EVERYBODY
def test_asking(people: Participants, who: str):
    """A request arrives at its owner if the table permits it, and nowhere otherwise."""
    sender = people.bus(who, "act")
    for topic in topics.QUERIES:
        key = sender.key(topic.key)
        allowed = may(who, "query", topic.key)
        assert replies(sender, key, who.encode()) == [b"owner"] * allowed, topic.key
        assert replies(people.asker(topic), key, b"last") == [b"owner"]
        assert up_to(people.arrived, (key, b"last")) == [(key, who.encode())] * allowed, topic.key


@EVERYBODY
def test_asking_with_wildcards(people: Participants, who: str):
    """The router forwards no request with a wildcard, which could pass the table."""
    sender = people.bus(who, "act")
    for wide in ("**", "volley/**", "volley/arm/*", "volley/*/cancel", "volley/arm/c$*"):
        assert replies(sender, wide, b"wide") == []
    key = sender.key(topics.CANCEL.key)
    assert replies(people.asker(topics.CANCEL), key, b"last") == [b"owner"]
    assert up_to(people.arrived, (key, b"last")) == []


@EVERYBODY
def test_answering(people: Participants, who: str):
    """Only the owner's queryable receives requests."""
    impostor = people.bus(who, "act")

    def answer(query: zenoh.Query) -> None:
        with query:
            query.reply(query.key_expr, b"another")

    for topic in topics.QUERIES:
        key = impostor.key(topic.key)
        queryable = impostor.session.declare_queryable(key, answer, complete=True)
        fence(impostor)
        allowed = may(who, "declare_queryable", topic.key)
        assert replies(people.asker(topic), key, b"last") == [b"another"] * allowed + [b"owner"], topic.key
        queryable.undeclare()
        fence(impostor)
        up_to(people.arrived, (key, b"last"))


@EVERYBODY
def test_being_alive(people: Participants, who: str):
    """A role can declare its own token alone, so it cannot keep another service from starting."""
    sender, ear = people.bus(who, "act"), people.bus("viewer", "ear")
    for token in TOKENS:
        held = sender.session.liveliness().declare_token(sender.key(topics.alive_key(token)))
        fence(sender)
        assert ear.is_alive(token) == may(who, "liveliness_token", topics.alive_key(token)), token
        held.undeclare()
        fence(sender)
        assert not ear.is_alive(token)


@EVERYBODY
def test_asking_who_is_alive(people: Participants, who: str):
    """Every role may ask for tokens; a stranger receives no answer."""
    asker, holder = people.bus(who, "listen"), people.bus("planner", "act")
    seen: SimpleQueue[str] = SimpleQueue()
    token = holder.session.liveliness().declare_token(holder.key(topics.alive_key("planner")))
    fence(holder)
    assert asker.is_alive("planner", timeout=PATIENCE_S if who in BY_NAME else 1.0) == (who in BY_NAME)
    watch = asker.session.liveliness().declare_subscriber(
        asker.key(topics.alive_key("*")), at_once(lambda sample: seen.put(str(sample.key_expr))), history=True
    )
    fence(asker)
    assert seen.qsize() == (who in BY_NAME)
    watch.undeclare()
    token.undeclare()
    fence(holder)


@pytest.fixture(scope="module")
def other(tmp_path_factory: pytest.TempPathFactory) -> SecureCell:
    """Write a cell with its own certificate authority."""
    return SecureCell(tmp_path_factory.mktemp("other"))


def let_in(config_file: Path | None, connect: tuple[str, ...] = (), tries: int = 2) -> bool:
    """Return whether the router accepts a session; the first of several tries may fail on a busy machine."""
    left = iter(range(tries - 1, -1, -1))
    try:
        open_session(connect, config_file=config_file, give_up=lambda: next(left) == 0).close()
    except zenoh.ZError as error:
        assert "Unable to connect" in str(error)
        return False
    return True


@pytest.mark.usefixtures("people")
def test_who_is_not_let_in(cell: SecureCell, other: SecureCell):
    """Refuse plain TCP, no certificate, a certificate of another authority; refuse a router of another authority."""
    config = client_config(cell.cell, "operator")
    assert let_in(cell.write("good", config), tries=40)
    assert not let_in(None, (cell.endpoint.replace("tls/", "tcp/"),))
    tls = config["transport"]["link"]["tls"]
    config["transport"]["link"]["tls"] = tls | {"enable_mtls": False}
    assert not let_in(cell.write("without", config))
    theirs = {
        "connect_certificate": str(other.tls / "operator.pem"),
        "connect_private_key": str(other.tls / "operator.key"),
    }
    config["transport"]["link"]["tls"] = tls | theirs
    assert not let_in(cell.write("theirs", config))
    config["transport"]["link"]["tls"] = tls | {"root_ca_certificate": str(other.tls / "ca.pem")}
    assert not let_in(cell.write("distrusting", config))


def test_a_host_by_another_name_is_not_joined(tmp_path: Path):
    """A client refuses a router whose certificate does not have the name in its endpoint."""
    elsewhere = SecureCell(tmp_path, certified="robot.local")
    with elsewhere.host():
        assert not let_in(elsewhere.file("operator"))
        config = client_config(elsewhere.cell, "operator")
        config["transport"]["link"]["tls"]["verify_name_on_connect"] = False
        assert let_in(elsewhere.write("careless", config), tries=40)


@contextmanager
def secure_services(cell: SecureCell, library: Path) -> Iterator[Stack]:
    """Start sim, planner and controller on the stepped clock, each with its certificate; yield a tester's stack."""
    flags = {"clock": "stepped", "library": library}
    lines = {}
    for name in SERVICES:
        hosting = name == "sim"
        options = Options(
            listen=(cell.endpoint,) if hosting else (),
            connect=() if hosting else (cell.endpoint,),
            zenoh_config=cell.file("router" if hosting else name),
            loop_core=LOOP_CORE,
        )
        lines[name] = command_lines(options, flags)[name]
    with Supervisor(lines) as supervisor, cell.join("tester") as bus:
        supervisor.wait_ready(bus)
        stack = Stack(supervisor, bus, cell.endpoint, library.parent, ROBOT, True)
        wait_for_controller(stack)
        yield stack


def test_a_motion_over_tls(other: SecureCell, tmp_path: Path):
    """An operator's goal is played to its end; a viewer can read the status, but neither start nor stop a motion."""
    with (
        secure_services(other, tmp_path / "library") as stack,
        other.join("operator") as operator,
        other.join("viewer") as viewer,
    ):
        stack.reset()
        goal = m.Goal(primitive="forehand", positions=HOME, duration=0.3)
        with pytest.raises(NoAnswer):
            viewer.ask(topics.GOAL, goal)
        with pytest.raises(NoAnswer):
            operator.ask(topics.SIM_STEP, m.Step(ticks=1))
        reply = operator.ask(topics.GOAL, goal)
        stack.step(100)
        with pytest.raises(NoAnswer):
            viewer.ask(topics.CANCEL, m.Cancel())
        assert viewer.ask(topics.STATUS_QUERY, m.Empty()).goal_id == reply.goal_id
        result = stack.finish(reply)
        assert result.outcome == "succeeded"
        assert stack.status().cycle.refused == 0


def pack(body: object) -> bytes:
    """Return `body` as msgpack."""
    data = msgpack.packb(body)
    assert data is not None
    return data


def refusals(stack: Stack, key: str, body: bytes, timeout: float = PATIENCE_S) -> list[str]:
    """Send a body and return the codes of the refusals; "taken" stands for a reply, "silent" for a timeout."""
    replies = stack.bus.session.get(stack.bus.key(key), payload=body, timeout=timeout)
    codes = []
    for reply in replies:
        answer = reply.ok or reply.err
        assert answer is not None
        body = answer.payload.to_bytes()
        codes.append("taken" if reply.ok else "silent" if body == b"Timeout" else msgpack.unpackb(body)["code"])
    return codes


def test_more_than_a_message_may_have(stack: Stack):
    """64 MiB never reach a service, whose connection stays open; 17 MiB reach it and are refused."""
    assert refusals(stack, "learn", bytes(64 << 20), timeout=2.0) == ["silent"]
    assert refusals(stack, "learn", bytes(17 << 20)) == ["bad_message"]
    for topic in (topics.STATE, topics.COMMAND, topics.STATUS):
        stack.bus.session.put(stack.bus.key(topic.key), bytes(64 << 20))
    assert stack.finish(stack.goal(primitive="forehand", positions=HOME, duration=0.3)).outcome == "succeeded"
    assert stack.services.ended() == {}


def test_a_nesting_bomb(stack: Stack):
    """A million nested arrays are refused as a body and in a field; published, they harm no service."""
    for bomb in (b"\x91" * 1_000_000, b"\x81\xa1a" + b"\x91" * 1_000_000, b"\x81\xa1a" * 300_000):
        for topic in topics.QUERIES:
            assert refusals(stack, topic.key, bomb) == ["bad_message"], topic.key
        for topic in topics.PUBLICATIONS:
            stack.bus.session.put(stack.bus.key(topic.key), bomb)
    assert stack.finish(stack.goal(primitive="forehand", positions=HOME, duration=0.3)).outcome == "succeeded"
    assert stack.services.ended() == {}


def test_a_million_samples(stack: Stack):
    """A trajectory that claims a million samples is refused; 48 MB of demonstration never reach the planner."""
    names, samples = list(ROBOT.joint_names), bytes(8 * 6 * 27_000)
    trajectory = {"goal_id": "endless", "epoch": 0, "joint_names": names, "start_time": 1.0, "dt": 0.001}
    trajectory |= {"count": 1_000_000, "hit_index": 999_999}
    trajectory |= dict.fromkeys(("positions", "velocities", "accelerations"), samples)
    assert refusals(stack, "execute", pack(trajectory)) == ["bad_message"]
    assert refusals(stack, "learn", pack({"name": "endless", "positions": bytes(8 * 6_000_000)}), 2.0) == ["silent"]
    assert stack.finish(stack.goal(primitive="forehand", positions=HOME, duration=0.3)).outcome == "succeeded"
    assert stack.services.ended() == {}


def test_a_second_router_ends_as_taken(tmp_path: Path, caplog: pytest.LogCaptureFixture):
    """A second sim with the configuration of the first ends as taken, over TLS too. The file's port is the bus's."""
    cell = SecureCell(tmp_path)
    options = Options(zenoh_config=cell.file("router"))
    stopping = threading.Event()

    def look_from_outside(bus: Bus) -> None:
        bus.announce("sim")
        with cell.join("viewer") as viewer:
            assert viewer.is_alive("sim")
        second = SingleInstance("sim", options, "arm", LOG, hosts=True)
        assert second.run(lambda _: pytest.fail(), stopping) is Outcome.TAKEN

    assert SingleInstance("sim", options, "arm", LOG, hosts=True).run(look_from_outside, stopping) is Outcome.ENDED
    assert "another sim serves robot arm on this bus" in caplog.text
