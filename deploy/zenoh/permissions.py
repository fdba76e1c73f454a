"""The permission table of a robot cell, derived from the topic table: which role may send what on which key.

A role is what a certificate's common name says, `ROLE.ROBOT`. The bus's router judges every message where it enters,
so the table names what a role may *send*; whatever it does not name is refused.
"""

from dataclasses import dataclass

from protocol import topics
from protocol.topics import PUBLICATIONS, QUERIES, ROBOT_SIDE, Query, alive_key, claim_key, client_alive_key

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
"""Everything that Zenoh's access control tells apart."""


@dataclass(frozen=True, slots=True)
class Role:
    """One kind of participant.

    A role owns the topics whose `owner` has its name. `asks` are the requests it may send beyond those that read;
    `tokens` the liveliness tokens it may hold, keys without the robot's prefix.
    """

    name: str
    about: str
    asks: tuple[Query, ...] = ()
    tokens: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Permission:
    """The messages that may be sent on keys, given without the robot's prefix."""

    messages: tuple[str, ...]
    keys: tuple[str, ...]


def serving(service: str) -> tuple[str, ...]:
    """Return the tokens that a service holds: that it is there, and its claim on the place."""
    return alive_key(service), claim_key(service, "*")


OPERATING = (topics.GOAL, topics.LEARN, topics.FORGET, topics.CANCEL, topics.RESET, topics.RECOVER)
SIMULATING = (topics.SIM_STEP, topics.SIM_RESET, topics.SIM_DISTURB)

ROLES = (
    Role("robot", "the robot side, simulated or real", tokens=serving(ROBOT_SIDE)),
    Role("planner", "plans, and alone may execute", asks=(topics.EXECUTE,), tokens=serving("planner")),
    Role("controller", "alone may command", tokens=serving("controller")),
    Role("recorder", "reads", tokens=serving("recorder")),
    Role("operator", "sends goals, teaches, stops", asks=OPERATING, tokens=(client_alive_key("*"),)),
    Role("viewer", "reads"),
    Role(
        "tester",
        "an operator who may also step and disturb a simulated arm; not for a cell with a real one",
        asks=(*OPERATING, *SIMULATING),
        tokens=(client_alive_key("*"),),
    ),
)


def common_name(role: str, robot: str) -> str:
    """Return the common name of the certificate that makes its holder `role` of `robot`."""
    return f"{role}.{robot}"


def reading() -> tuple[Permission, ...]:
    """Return what every role may send: subscriptions, requests that change nothing, questions who is alive."""
    return (
        Permission(("declare_subscriber",), tuple(topic.key for topic in PUBLICATIONS)),
        Permission(("query",), tuple(topic.key for topic in QUERIES if topic.reads)),
        Permission(WATCH_ALIVE, (alive_key("**"),)),
    )


def acting(role: Role) -> tuple[Permission, ...]:
    """Return what `role` may send beyond `reading`."""
    permissions = (
        Permission(("put",), tuple(topic.key for topic in PUBLICATIONS if topic.owner == role.name)),
        Permission(("declare_queryable", "reply"), tuple(topic.key for topic in QUERIES if topic.owner == role.name)),
        Permission(("query",), tuple(topic.key for topic in role.asks)),
        Permission(("liveliness_token",), role.tokens),
    )
    return tuple(permission for permission in permissions if permission.keys)
