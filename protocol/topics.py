"""The table of every key on the bus. Queues, permissions, recording and the reference page derive from it."""

import re
from dataclasses import dataclass
from typing import Generic, TypeVar

from msgspec import Struct

from protocol import messages as m

RequestT = TypeVar("RequestT", bound=Struct)
ReplyT = TypeVar("ReplyT", bound=Struct)
MessageT = TypeVar("MessageT", bound=Struct)

SMALL = 1 << 14
MIB = 1 << 20
QUEUE_LENGTH = 16
MAX_PLAN_S = 60.0
MAX_ID = 128
"""Largest length of a goal's or a client's id, characters."""
PRIMITIVE_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_-]{0,63}")
ROBOT_SIDE = "sim"
"""Name of the robot side, simulated or real, in its liveliness token: the first robot was a simulation."""


@dataclass(frozen=True, slots=True)
class Query(Generic[RequestT, ReplyT]):
    """A request and its reply on `key`, answered by `owner`.

    `reads`: the request changes nothing, so its key may contain a wildcard. `timeout_s`: how long a client waits for
    the reply. `max_bytes`: largest request; a 1 kHz loop must be able to decode it within a tick. `smaller`: what to
    send instead of a request that is too large.
    """

    key: str
    owner: str
    request: type[RequestT]
    reply: type[ReplyT]
    about: str
    reads: bool = False
    max_bytes: int = SMALL
    timeout_s: float = 5.0
    smaller: str = ""


@dataclass(frozen=True, slots=True)
class Publication(Generic[MessageT]):
    """A message that `owner` publishes on `key`, at `rate_hz`; None: whenever the event happens.

    `max_age_s`: an older message is stale; None: never. `stream`: sent with real-time priority; in real time only the
    newest message is kept.
    """

    key: str
    owner: str
    message: type[MessageT]
    about: str
    rate_hz: float | None = None
    max_age_s: float | None = None
    recorded: bool = True
    stream: bool = False


GOAL = Query("goal", "planner", m.Goal, m.GoalReply, "plan a motion and play it", max_bytes=MIB, timeout_s=60.0)
"""Long, because a goal of the method "gaussian" may first start a process, which takes 3 s of a processor."""
PRIMITIVES = Query("primitives", "planner", m.Empty, m.Primitives, "list the library", reads=True)
LEARN = Query("learn", "planner", m.Learn, m.Learned, "learn a primitive", max_bytes=16 * MIB, timeout_s=120.0)
"""Long, because learning takes up to 2 s of a processor at a low priority, which a busy machine serves last."""
FORGET = Query("forget", "planner", m.Forget, m.Forgotten, "remove a primitive")
EXECUTE = Query(
    "execute",
    "controller",
    m.Trajectory,
    m.Accepted,
    "play a trajectory",
    max_bytes=4 * MIB,
    timeout_s=1.0,
    smaller="send the motion as `pieces`",
)
REFERENCE = Query(
    "reference",
    "controller",
    m.ReferenceRequest,
    m.Reference,
    "return the reference at a future time",
    reads=True,
    timeout_s=1.0,
)
CANCEL = Query("cancel", "controller", m.Cancel, m.Canceled, "stop the motion")
RESET = Query("reset", "controller", m.Empty, m.ModeReply, "clear a fault; only at rest")
RESULT = Query("result", "controller", m.ResultRequest, m.Result, "return the result of a goal", reads=True)
STATUS_QUERY = Query("status", "controller", m.Empty, m.Status, "return the latest status", reads=True)
STATE_QUERY = Query("state", "robot", m.Empty, m.State, "return the latest state", reads=True)
DESCRIPTION = Query("description", "robot", m.Empty, m.Description, "describe the arm", reads=True)
RECOVER = Query(
    "recover", "robot", m.Empty, m.Recovered, "make the arm ready after a reflex, a stop or braking", timeout_s=30.0
)
HOLD = Query("hold", "robot", m.Hold, m.Held, "move held joints, for example a gripper's, to new values")
GUIDE = Query("guide", "robot", m.Empty, m.Guided, "start hand guiding, until `recover`; only at rest")
SIM_STEP = Query("sim/step", "robot", m.Step, m.Stepped, "advance the stepped clock", timeout_s=120.0)
SIM_RESET = Query("sim/reset", "robot", m.Reset, m.ResetDone, "begin a new run")
SIM_DISTURB = Query("sim/disturb", "robot", m.Disturb, m.Disturbed, "push the arm, add noise, drop messages")
SIM_BALL = Query("sim/ball", "robot", m.Throw, m.Thrown, "throw the ball")
STRIKE = Query("strike", "striker", m.StrikeRequest, m.Striking, "return balls within reach to a target")
STRIKE_STOP = Query("strike/stop", "striker", m.Empty, m.Striking, "stop striking")

STATE = Publication("state", "robot", m.State, "the measured state", rate_hz=1000.0, max_age_s=0.02, stream=True)
COMMAND = Publication(
    "command", "controller", m.Command, "the accelerations to apply", rate_hz=1000.0, max_age_s=0.02, stream=True
)
PLAN = Publication("plan", "planner", m.Plan, "an accepted motion")
REFUSED = Publication("refused", "planner", m.Refused, "a goal that was refused")
STATUS = Publication("status", "controller", m.Status, "the status of the controller", rate_hz=50.0, max_age_s=0.5)
ENDED = Publication("ended", "controller", m.Result, "the final result of a goal")
CONTACT = Publication("contact", "robot", m.Contact, "the beginning or the end of a contact")
BALL = Publication("ball", "robot", m.BallState, "the ball, as a camera sees it", rate_hz=100.0, max_age_s=0.5)
SCENE = Publication(
    "scene", "robot", m.Scene, "the joints that are not the arm's or the ball's", rate_hz=50.0, max_age_s=0.5
)
DISTURBANCE = Publication("disturbance", "robot", m.Disturbance, "the disturbances that act now")
STRIKES = Publication("strike", "striker", m.Strike, "the decisions and observations of the striker")

QUERIES: tuple[Query, ...] = tuple(topic for topic in list(vars().values()) if isinstance(topic, Query))
"""Every request above, in their order."""
PUBLICATIONS: tuple[Publication, ...] = tuple(each for each in list(vars().values()) if isinstance(each, Publication))
"""Every publication above, in their order."""


def check_robot_name(name: str) -> None:
    """Check that `name` can be the second part of every key.

    Raises: ValueError: it cannot; the sentence says why.
    """
    if {"", ".", ".."} & set(name.split("/")) or set(name) & set("*$?#") or not name.isprintable():
        raise ValueError(
            f"name: {name!r} cannot be a part of a key; use at least one printable character, none of * $ ? #, "
            "/ only between other characters, and no part . or .., because the name is also that of a directory"
        )


def id_fault(field: str, name: str) -> str | None:
    """Return a sentence that says why `name` cannot be the id of a goal or a client, None if it can."""
    if 0 < len(name) <= MAX_ID and name.isprintable():
        return None
    return f"{field} is {name[:40]!r} with {len(name)} characters; an id has 1 to {MAX_ID}, all of them printable"


def legible(name: str) -> str:
    """Return a name of any kind in the form of an id: shortened, and � for what cannot be printed."""
    return "".join(character if character.isprintable() else "�" for character in name[:MAX_ID])


def alive_key(service: str) -> str:
    """Return the key of the liveliness token of a service, or of client/ID, without the robot's prefix."""
    return f"alive/{service}"


def claim_key(service: str, session: str) -> str:
    """Return the key of the token by which a session claims a service for itself, without the robot's prefix."""
    return alive_key(f"{service}/{session}")
