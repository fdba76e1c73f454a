"""`volley watch`: live status in the terminal."""

import sys
import threading
import time
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass, field

from msgspec import Struct
from rich import box
from rich.console import Group, RenderableType
from rich.live import Live
from rich.panel import Panel
from rich.styled import Styled
from rich.text import Text

from client import Stream
from deploy.processes import PROCESSES
from protocol import messages as m
from protocol.errors import Refusal
from protocol.topics import CONTACT, DISTURBANCE, ENDED, PLAN, REFUSED, STATUS, Publication, alive_key
from services.common.signals import stop_on_signals
from tools.shell.shell import Shared, Shell, reach
from tools.shell.show import show
from tools.shell.tables import cell

REFRESH_HZ = 10.0
EVENTS_SHOWN = 8
KEPT = 64
"""Queue capacity of each topic between two screen updates, messages."""
WATCHED: tuple[Publication, ...] = (STATUS, PLAN, REFUSED, ENDED, CONTACT, DISTURBANCE)


@dataclass(slots=True)
class View:
    """State of the screen; `received` is the newest status's arrival time, monotonic s, or None before the first."""

    joint_names: list[str]
    stepped: bool
    status: m.Status | None = None
    received: float | None = None
    alive: set[str] = field(default_factory=set)
    events: deque[str] = field(default_factory=lambda: deque(maxlen=EVENTS_SHOWN))

    def take(self, topic: Publication, message: Struct | Refusal, now: float) -> None:
        """Add one publication, or the refusal that explains why it cannot be decoded."""
        if isinstance(message, m.Status):
            self.status, self.received = message, now
        elif isinstance(message, Refusal):
            self.events.append(f"malformed {topic.key}: {message}")
        else:
            self.events.append(event(message))


def event(message: object) -> str:
    """Return one line that describes a publication."""
    match message:
        case m.Plan():
            hit = message.start_time + message.hit_index * message.dt
            corrects = f"corrects {message.revises} at phase {message.phase:.3f}, " if message.revises else ""
            played = f"{message.primitive}, {corrects}hits at {hit:.3f} s"
            return f"{message.start_time:9.3f} s  plan {message.goal_id}: {played}"
        case m.Result():
            when = f"{message.hit.time:9.3f} s" if message.hit else " " * 11
            error = f", off by {cell(max(map(abs, message.hit.position_error)))} rad" if message.hit else ""
            return f"{when}  {message.outcome} {message.goal_id}{error}{': ' if message.reason else ''}{message.reason}"
        case m.Refused():
            return f"{' ' * 11}  refused {message.goal_id or 'a goal'} as {message.code}: {message.message}"
        case m.Contact():
            speed = sum(v * v for v in message.ball_velocity) ** 0.5 if message.ball_velocity else None
            ball = f", ball at {speed:.2f} m/s" if speed is not None else ""
            touch = f"{' parted from ' if message.ended else ' touches '}".join(message.bodies)
            return f"{message.time:9.3f} s  {touch}: {cell(message.impulse)} N·s{ball}"
        case m.Disturbance():
            kinds = ", ".join(active.kind for active in message.active)
            return f"{message.time:9.3f} s  {f'disturbed by {kinds}' if kinds else 'disturbed no more'}"
    return str(message)


def render(view: View, now: float) -> RenderableType:
    """Return the screen."""
    alive = Text("  ").join(
        Text(f"● {name}" if name in view.alive else f"○ {name}", "green" if name in view.alive else "dim")
        for name in (process.name for process in PROCESSES if not process.optional or process.name in view.alive)
    )
    parts: list[RenderableType] = [alive]
    silence = silent(view, now)
    if silence:
        parts.append(Text(silence, "bold yellow"))
    if view.status:
        parts.append(Styled(show(view.status, view.joint_names), "dim" if silence else ""))
    events = "\n".join(view.events) or "nothing has happened since this began"
    parts.append(Panel(Text(events), title="events", title_align="left", box=box.ROUNDED, border_style="dim"))
    return Group(*parts)


def silent(view: View, now: float) -> str:
    """Return a sentence if no recent status has arrived, otherwise an empty string."""
    if view.received is None:
        return "no status yet: " + ("waiting for the controller" if view.alive else "nobody is on this bus")
    age = now - view.received
    if age <= (STATUS.max_age_s or 0.0):
        return ""
    if "controller" not in view.alive:
        return f"no status for {age:.0f} s: the controller is gone"
    return f"no status for {age:.0f} s" + (": the stepped clock waits for a step" if view.stepped else "")


def watch(*, shell: Shared) -> None:
    """Show the status, the joints, the loop's timing and events, until Ctrl-C.

    With --json every message is printed on arrival, one line each.
    """
    with reach(shell) as link:
        stopping = stop_on_signals()
        streams = [link.arm.stream(topic, KEPT) for topic in WATCHED]
        if shell.json:
            _print_lines(link, streams, stopping)
        else:
            _paint(link, streams, stopping)


def _paint(link: Shell, streams: list[Stream], stopping: threading.Event) -> None:
    description = link.description()
    view = View(joint_names=link.joint_names(), stepped=description is not None and description.clock == "stepped")

    def note(key: str, alive: bool) -> None:
        name = key.rsplit("/", 1)[-1]
        view.alive = view.alive | {name} if alive else view.alive - {name}

    link.arm.bus.watch_alive(alive_key("*"), note)
    with Live(console=link.console, screen=link.console.is_terminal, auto_refresh=False) as live:
        stopped = False
        while not stopped:
            stopped = stopping.wait(1.0 / REFRESH_HZ)
            for topic, message in _drain(streams):
                view.take(topic, message, time.monotonic())
            live.update(render(view, time.monotonic()), refresh=True)


def _print_lines(link: Shell, streams: list[Stream], stopping: threading.Event) -> None:
    while not stopping.wait(1.0 / REFRESH_HZ):
        for topic, message in _drain(streams):
            if isinstance(message, Refusal):
                print(f"malformed {topic.key}: {message}", file=sys.stderr)
            else:
                link.print(message)


def _drain(streams: list[Stream]) -> Iterator[tuple[Publication, Struct | Refusal]]:
    """Yield every message that has arrived, and a refusal in place of each that cannot be decoded."""
    for stream in streams:
        while True:
            try:
                yield stream.topic, stream.take(timeout=0.0)
            except Refusal as malformed:
                yield stream.topic, malformed
            except TimeoutError:
                break
