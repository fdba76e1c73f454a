"""The permission table of a robot cell, derived from the topic table: which role may send what on which key.

A role is given by a certificate's common name, `ROLE.ROBOT`. The router checks every message where it enters, so the
table lists what a role may *send*; everything else is refused.
"""

from dataclasses import dataclass

from protocol import topics
from protocol.topics import PUBLICATIONS, QUERIES, ROBOT_SIDE, Query, alive_key, claim_key

WATCH_ALIVE = ("liveliness_query", "declare_liveliness_subscriber")
MESSAGES = (
    "put",
    "delete",
    "declare_subscriber",
    "query",
    "reply",
    "declare_queryable",
    "liveliness_token",
    *WATCH_ALIVE,
)
"""All kinds of messages that Zenoh's access control distinguishes."""


@dataclass(frozen=True, slots=True)
class Role:
    """One kind of participant.

    A role owns the topics whose `owner` has its name. `asks`: requests that it may send besides those that only read.
    `tokens`: liveliness tokens that it may hold, as keys without the robot's prefix.
    """

    name: str
    about: str
    asks: tuple[Query, ...] = ()
    tokens: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Permission:
    """Kinds of messages that may be sent on keys; the keys lack the robot's prefix."""

    messages: tuple[str, ...]
    keys: tuple[str, ...]


def serving(service: str) -> tuple[str, ...]:
    """Return the tokens that a service holds: that it is alive, and its claim to be the only instance."""
    return alive_key(service), claim_key(service, "*")


OPERATING = (
    topics.GOAL, topics.LEARN, topics.FORGET, topics.CANCEL, topics.RESET, topics.RECOVER, topics.HOLD, topics.GUIDE,
)  # fmt: skip
STRIKING = (topics.STRIKE, topics.STRIKE_STOP)
SIMULATING = (topics.SIM_STEP, topics.SIM_RESET, topics.SIM_DISTURB, topics.SIM_BALL)

ROLES = (
    Role("robot", "the robot side, simulated or real", tokens=serving(ROBOT_SIDE)),
    Role("planner", "plans; the only role that may execute", asks=(topics.EXECUTE,), tokens=serving("planner")),
    Role("controller", "the only role that may command", tokens=serving("controller")),
    Role("recorder", "reads", tokens=serving("recorder")),
    Role("striker", "sends goals to return a ball", asks=(topics.GOAL, topics.CANCEL), tokens=serving("striker")),
    Role(
        "operator",
        "sends goals, teaches, strikes, stops",
        asks=(*OPERATING, *STRIKING),
        tokens=(alive_key("client/*"),),
    ),
    Role("viewer", "reads"),
    Role(
        "tester",
        "an operator that may also step and disturb a simulated arm; not for a cell with a real arm",
        asks=(*OPERATING, *STRIKING, *SIMULATING),
        tokens=(alive_key("client/*"),),
    ),
)


def common_name(role: str, robot: str) -> str:
    """Return the common name of the certificate that makes its holder `role` of `robot`."""
    return f"{role}.{robot}"


def reading() -> tuple[Permission, ...]:
    """Return what every role may send: subscriptions, requests that change nothing, liveliness queries."""
    return (
        Permission(("declare_subscriber",), tuple(topic.key for topic in PUBLICATIONS)),
        Permission(("query",), tuple(topic.key for topic in QUERIES if topic.reads)),
        Permission(WATCH_ALIVE, (alive_key("**"),)),
    )


def acting(role: Role) -> tuple[Permission, ...]:
    """Return what `role` may send besides `reading`."""
    permissions = (
        Permission(("put",), tuple(topic.key for topic in PUBLICATIONS if topic.owner == role.name)),
        Permission(("declare_queryable", "reply"), tuple(topic.key for topic in QUERIES if topic.owner == role.name)),
        Permission(("query",), tuple(topic.key for topic in role.asks)),
        Permission(("liveliness_token",), role.tokens),
    )
    return tuple(permission for permission in permissions if permission.keys)
