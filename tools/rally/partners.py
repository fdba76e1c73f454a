"""Two arms rally with each other: `volley rally --partners 2`."""

import contextlib
import json
import tempfile
import threading
import time
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from pathlib import Path
from queue import Empty, SimpleQueue
from statistics import median
from typing import Any

import numpy as np
from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn
from rich.table import Table

from deploy.processes import PROCESSES
from protocol import messages as m
from protocol import topics
from protocol.bus.bus import Bus
from protocol.codec import decode
from protocol.errors import NoAnswer, Refusal
from robot.court import BALL
from robot.description import RobotConfig, load_robot
from robot.shipped import DEFAULT_ROBOT_CONFIG
from services.common.cell import RunningCell, running_cell
from services.common.cli import Options, free_endpoint
from tools.rally.exchange import away, exchange, serve
from tools.rally.referee import Referee

ROBOTS = tuple(DEFAULT_ROBOT_CONFIG.with_name(name) for name in ("near.toml", "far.toml"))
"""The first one's sim moves both arms."""
SEEN = (topics.BALL, topics.CONTACT)
"""What the referee follows, in the time of the first arm."""
READY_S = 30.0
"""How long (wall time) the arms may take to come to rest before the next serve is thrown all the same."""
REST_S = 0.2
"""How long (robot time) they rest."""
STALLED_S = 10.0
"""A sim that shows no ball for so long (wall time) is gone."""


@dataclass(slots=True, eq=False)
class Rally:
    """One rally: who served, how many strokes counted, why it ended, how long it took (s, robot time)."""

    server: str
    strokes: int = 0
    over: str = ""
    duration: float = 0.0
    violations: list[str] = field(default_factory=list)


class Court:
    """Plays rallies on the services of two running cells."""

    def __init__(self, buses: Mapping[str, Bus], configs: Mapping[str, RobotConfig], seed: int, most: int) -> None:
        """`buses`, `configs`: of both arms, by name; `most`: strokes after which a rally ends."""
        self._buses, self._configs, self._most = buses, configs, most
        self._random = np.random.default_rng(seed)
        self._received: SimpleQueue[tuple[str, m.BallState | m.Contact | m.Result | m.Strike]] = SimpleQueue()
        self._first = next(iter(buses))
        for topic in SEEN:
            self._listen(self._first, topic)
        for name in buses:
            self._listen(name, topics.ENDED)
            self._listen(name, topics.STRIKES)
        one, other = configs
        self._exchanges = {a: exchange(configs[a], configs[b]) for a, b in ((one, other), (other, one))}

    def begin(self, noise: m.Disturb | None, revise_hz: float) -> None:
        """Blur the cameras, and ask both strikers to strike."""
        for name, bus in self._buses.items():
            if noise is not None:
                bus.ask(topics.SIM_DISTURB, noise)
            play = self._exchanges[name]
            x, y, z = play.target.tolist()
            order = m.StrikeRequest(target=(x, y, z), flight_time=play.flight_time, revise_hz=revise_hz)
            bus.ask(topics.STRIKE, order)

    def play(self, server: str) -> Iterator[Rally]:
        """Serve from the half of `server`, and yield the rally after every stroke and at its end.

        Raises:
            Refusal: the ball cannot be served.
            NoAnswer: the sim is silent.
        """
        self._buses[self._first].ask(topics.SIM_BALL, away(self._configs[self._first]))
        self._wait_for_rest()
        receiver = next(name for name in self._configs if name != server)
        rally, reasons = Rally(server), dict.fromkeys(self._buses, "")
        throw = serve(self._configs[server], self._exchanges[server], self._random)
        self._drain()
        served = self._buses[self._first].ask(topics.SIM_BALL, throw).time
        referee, now = Referee(self._configs, receiver, served), served
        while not referee.over and referee.strokes < self._most:
            name, message = self._take()
            match message:
                case m.BallState():
                    now = max(now, message.time)
                    referee.see(message)
                case m.Contact():
                    referee.touch(message)
                    rally.violations += _clash(message)
                case m.Strike():
                    reasons[name] = message.reason if message.phase in ("refused", "missed") else ""
                case m.Result() if message.outcome == "aborted":
                    rally.violations.append(f"{name}: goal {message.goal_id} was aborted: {message.reason}")
            if referee.strokes > rally.strokes:
                rally.strokes, rally.duration = referee.strokes, now - served
                yield rally
        said = "; ".join(f"{name}: {reason}" for name, reason in reasons.items() if reason)
        rally.over = f"{referee.over}{f' ({said})' if said else ''}" if referee.over else "as many as were asked for"
        rally.strokes, rally.duration = referee.strokes, now - served
        yield rally

    def _listen(self, name: str, topic: topics.Publication[Any]) -> None:
        self._buses[name].listen(topic, lambda body: self._received.put((name, decode(body, topic.message))))

    def _take(self) -> tuple[str, Any]:
        """Return the next message, and the arm that it is from. Raises NoAnswer where none comes."""
        try:
            return self._received.get(timeout=STALLED_S)
        except Empty:
            key = self._buses[self._first].key(topics.BALL.key)
            raise NoAnswer("sim", key, f"no ball was seen for {STALLED_S:g} s") from None

    def _drain(self) -> None:
        with contextlib.suppress(Empty):
            while True:
                self._received.get_nowait()

    def _wait_for_rest(self) -> None:
        """Return once both arms have rested for a moment of robot time, at the latest after `READY_S`."""
        since: dict[str, float] = {}
        deadline = time.monotonic() + READY_S
        while time.monotonic() < deadline:
            rested = [self._rests(name, bus, since) for name, bus in self._buses.items()]
            if all(rested):
                return
            time.sleep(0.05)

    @staticmethod
    def _rests(name: str, bus: Bus, since: dict[str, float]) -> bool:
        """Return whether an arm has rested long enough; `since`: from when on (s) each does. A fault is reset."""
        with contextlib.suppress(Refusal, NoAnswer):
            status = bus.ask(topics.STATUS_QUERY, m.Empty())
            if status.mode == "fault":
                bus.ask(topics.RESET, m.Empty())
            if status.mode == "holding":
                return status.time - since.setdefault(name, status.time) > REST_S
            since.pop(name, None)
        return False


def _clash(contact: m.Contact) -> list[str]:
    """Return a sentence for a contact that no rally should have: one without the ball."""
    if BALL in contact.bodies or contact.ended:
        return []
    return [f"{' and '.join(contact.bodies)} touched at {contact.time:.3f} s"]


@contextlib.contextmanager
def two_cells(
    options: Options, flags: Mapping[str, object], learned: Path | None, quiet: bool
) -> Iterator[list[RunningCell]]:
    """Start the services of both arms on one bus: one sim and one recorder, which shows both, for the two of them.

    Raises:
        NotReady: a service ended, or did not become ready in time.
    """
    endpoint = options.listen or options.connect or (free_endpoint(),)
    near, far = ROBOTS
    names = [process.name for process in PROCESSES]
    with tempfile.TemporaryDirectory(prefix="volley-rally-") as scratch, contextlib.ExitStack() as stack:
        folder = learned or Path(scratch)
        folder.mkdir(parents=True, exist_ok=True)
        hosting = replace(options, robot_config=near, listen=() if options.connect else endpoint)
        joining = replace(options, robot_config=far, listen=(), connect=endpoint)
        others = [name for name in names if name not in ("sim", "recorder")]
        given_up = threading.Event()
        starting = [
            running_cell(options, {**flags, **more}, names, quiet=quiet, give_up=given_up.is_set)
            for options, more, names in (
                (hosting, {"also": (far,), "learned": folder / "near.json"}, names),
                (joining, {"learned": folder / "far.json"}, others),
            )
        ]
        ending = [stack.enter_context(contextlib.ExitStack()) for _ in starting]  # the second one first, on its bus
        with ThreadPoolExecutor() as pool:  # the second cell waits for the first one's bus
            try:
                cells: list[RunningCell] = list(pool.map(contextlib.ExitStack.enter_context, ending, starting))
            except BaseException:
                given_up.set()
                raise
        yield cells


def play_rallies(court: Court, rallies: int, names: Sequence[str], console: Console, played: list[Rally]) -> None:
    """Play, the arms serving in turn, and show progress; the rallies are appended as they are played."""
    columns = SpinnerColumn(), TextColumn("{task.description}"), TimeElapsedColumn()
    with Progress(*columns, console=console, transient=True) as progress:
        shown = progress.add_task("the first serve")
        for number in range(rallies):
            server = names[number % len(names)]
            rally = Rally(server)
            for rally in court.play(server):
                progress.update(shown, description=f"rally {number + 1} of {rallies}, {rally.strokes} strokes")
            played.append(rally)


def summary(played: Sequence[Rally]) -> dict[str, object]:
    """Return the figures of all rallies."""
    strokes = [rally.strokes for rally in played]
    return {
        "rallies": len(played),
        "strokes": strokes,
        "median_strokes": median(strokes) if strokes else None,
        "violations": sum(len(rally.violations) for rally in played),
    }


def json_line(played: Sequence[Rally]) -> str:
    """Return the figures as one line."""
    return json.dumps(summary(played))


def table(played: Sequence[Rally]) -> Table:
    """Return one row for each rally."""
    shown = Table(title="Two arms", box=SIMPLE_HEAD, padding=0)
    for heading in ("rally", "served by", "strokes", "s"):
        shown.add_column(heading, justify="right", no_wrap=True)
    shown.add_column("ended by", overflow="fold")
    for number, rally in enumerate(played, 1):
        shown.add_row(str(number), rally.server, str(rally.strokes), f"{rally.duration:.1f}", rally.over)
    return shown


def sentence(played: Sequence[Rally]) -> str:
    """Return the figures in words."""
    found = summary(played)
    return (
        f"{found['rallies']} rallies, {found['median_strokes']} strokes in the median; {found['violations']} violations"
    )


def load_partners() -> dict[str, RobotConfig]:
    """Return both robots by name."""
    configs = [load_robot(path) for path in ROBOTS]
    return {config.name: config for config in configs}
