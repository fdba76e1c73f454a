"""The table of every entity of a trace. Writers, styles and the page `docs/trace.md` take their paths from it."""

import re
from dataclasses import dataclass
from functools import partial
from typing import Literal

from protocol import topics
from protocol.topics import Publication

Event = Literal[
    "", "a ball", "a plan", "a correction", "a goal", "a result", "a hit", "a refusal", "a contact", "a disturbance",
    "a push", "a strike", "a returned ball", "known truth", "something missing",
]  # fmt: skip
"""What must occur for an entity to be in a trace; empty: every trace of a sim and a controller has it."""

NAME = re.compile("[A-Z]+")


@dataclass(frozen=True, slots=True)
class Entity:
    """A row of the table: one entity, or one for each joint, body or part of a body.

    Attributes:
        section: Of the page, with this title.
        path: JOINT, BODY and PART stand for names.
        archetype: Rerun's; `AnyValues` has columns of its own.
        source: Publications whose messages it shows; empty: the recorder's own, or the robot's model.
        shows: One line of the page.
        unit: Of its numbers.
        needs: What must occur for it to be in a trace.
        static: Holds at all times; it is on no timeline.
    """

    section: str
    path: str
    archetype: str
    source: tuple[Publication, ...]
    shows: str
    unit: str = ""
    needs: Event = ""
    static: bool = False

    def at(self, *names: str) -> str:
        """Return the path with names in place of JOINT, BODY and PART, in their order."""
        path = self.path
        for word, name in zip(NAME.findall(self.path), names, strict=True):
            path = path.replace(word, name, 1)
        return path


STATE, COMMAND, STATUS = (topics.STATE,), (topics.COMMAND,), (topics.STATUS,)
PLAN, ENDED, REFUSED = (topics.PLAN,), (topics.ENDED,), (topics.REFUSED,)
BALL, CONTACT, DISTURBANCE, SCENE = (topics.BALL,), (topics.CONTACT,), (topics.DISTURBANCE,), (topics.SCENE,)
STRIKES = (topics.STRIKES,)
GOAL = (*PLAN, *ENDED, *REFUSED)
OWN: tuple[Publication, ...] = ()

SCALARS, LANE, EVENT, VALUES = "Scalars", "StateChange", "TextLog", "AnyValues"
POSE, LINES, POINTS, ARROWS, SHAPES = "Transform3D", "LineStrips3D", "Points3D", "Arrows3D", "Boxes3D, Mesh3D, …"

section = partial(Entity, "Joints")

MEASURED_POSITION = section("/joints/JOINT/position/measured", SCALARS, STATE, "measured position", "rad")
MEASURED_VELOCITY = section("/joints/JOINT/velocity/measured", SCALARS, STATE, "measured velocity", "rad/s")
REFERENCE_POSITION = section("/joints/JOINT/position/reference", SCALARS, COMMAND, "reference position", "rad")
REFERENCE_VELOCITY = section("/joints/JOINT/velocity/reference", SCALARS, COMMAND, "reference velocity", "rad/s")
COMMANDED = section("/joints/JOINT/acceleration/commanded", SCALARS, COMMAND, "commanded acceleration", "rad/s²")
ERROR = section("/joints/JOINT/error", SCALARS, (*STATE, *COMMAND), "measured less reference of the same tick", "rad")
PLANNED = {
    quantity: section(f"/joints/JOINT/{quantity}/planned", SCALARS, PLAN, f"planned {quantity}", unit, "a plan")
    for quantity, unit in (("position", "rad"), ("velocity", "rad/s"), ("acceleration", "rad/s²"))
}
DEMONSTRATED = section(
    "/joints/JOINT/position/demonstrated", SCALARS, PLAN, "the demonstration, warped to the duration", "rad", "a plan"
)
TARGET = section("/joints/JOINT/position/target", SCALARS, PLAN, "goal and waypoints", "rad", "a plan")
CORRECTED = section(
    "/joints/JOINT/position/corrected",
    SCALARS,
    PLAN,
    "where a correction takes over from the plan that it corrects",
    "rad",
    "a correction",
)
LIMITS = {
    quantity: section(
        f"/joints/JOINT/{quantity}/limits", SCALARS, PLAN, "[lowest, highest] in force: the plan's or the robot's", unit
    )
    for quantity, unit in (("position", "rad"), ("velocity", "rad/s"), ("acceleration", "rad/s²"))
}
PUSHES = {
    kind: section(
        f"/joints/JOINT/disturbance/{kind}", SCALARS, DISTURBANCE, "sum of the active pushes", unit, "a disturbance"
    )
    for kind, unit in (("acceleration", "rad/s²"), ("torque", "N·m"))
}

section = partial(Entity, "Arm")

TORQUES = section("/arm/torques", SCALARS, STATE, "torque of each joint", "N·m")
SATURATED = section("/arm/saturated", SCALARS, STATE, "whether each joint's torque is at its limit, 0 or 1")
APPLIED_TICK = section("/arm/applied_tick", SCALARS, STATE, "tick of the command that was applied, as in the message")
TRUE_POSITION = section("/arm/true_position", SCALARS, STATE, "positions without sensor noise", "rad", "known truth")
TRUE_VELOCITY = section("/arm/true_velocity", SCALARS, STATE, "velocities without sensor noise", "rad/s", "known truth")

section = partial(Entity, "Runs and goals")

RUNS = section("/runs", VALUES, (*STATE, *COMMAND), "`run`, `tick_offset`, `time_offset` (s) of each run")
PLANS = section(
    "/plans",
    VALUES,
    PLAN,
    "`goal_id`, `primitive`, `start_time` as in the message, `epoch`, `revises` (empty: none), `phase`; `deviation` "
    "from the demonstration (rad, the largest of all joints), `clearance` (m) and `torque_use` (the largest of all "
    "joints), NaN where they are not known",
    needs="a plan",
)
GOALS = section(
    "/goals",
    VALUES,
    ENDED,
    "`goal_id`, `outcome`, `reason`, `peak_tracking_error` (rad), `saturated_ticks`, `first_contact` (in words, empty: "
    "none); `requested`, `planned`, `accepted`, `first_command` (Unix ns, 0: never)",
    needs="a result",
)
HIT_POSITION_ERROR = section(
    "/goals/position_error", SCALARS, ENDED, "error of each joint at the hit, at its time", "rad", "a hit"
)
HIT_VELOCITY_ERROR = section(
    "/goals/velocity_error", SCALARS, ENDED, "error of each joint at the hit, at its time", "rad/s", "a hit"
)
REFUSALS = section(
    "/goals/refused",
    VALUES,
    REFUSED,
    "`goal_id` (empty: none), `client_id`, `primitive`, `code`, `requested` (Unix ns)",
    needs="a refusal",
)

section = partial(Entity, "Events")

RUN_EVENT = section("/events/run", EVENT, (*STATE, *COMMAND), "a run begins")
GOAL_EVENT = section("/events/goal", EVENT, GOAL, "a goal is planned, refused or ended", needs="a goal")
CONTACT_EVENT = section("/events/contact", EVENT, CONTACT, "two bodies touch, or part", needs="a contact")
CONTROLLER_EVENT = section("/events/controller", EVENT, (*STATUS, *STATE), "modes, faults, late ticks, an unready arm")
DISTURBANCE_EVENT = section("/events/disturbance", EVENT, DISTURBANCE, "disturbances change", needs="a disturbance")
RECORDER_EVENT = section("/events/recorder", EVENT, OWN, "what is missing in the trace", needs="something missing")

section = partial(Entity, "Lanes")

MODE_LANE = section("/lanes/mode", LANE, STATUS, "the controller's mode")
GOAL_LANE = section("/lanes/goal", LANE, COMMAND, "the goal that the reference serves", needs="a plan")
CONDITION_LANE = section("/lanes/condition", LANE, STATE, "the arm's condition, empty while it is ready")
DISTURBANCE_LANE = section("/lanes/disturbance", LANE, DISTURBANCE, "kinds that are active", needs="a disturbance")

section = partial(Entity, "Timing")

LATE = section("/timing/late_us", SCALARS, STATUS, "p50, p99 and maximum from state to command", "µs")
LOOP = {
    "on_time_ratio": section("/timing/on_time_ratio", SCALARS, STATUS, "share of ticks answered in time"),
    "missed": section("/timing/missed", SCALARS, STATUS, "ticks without an answer in time, in all"),
    "count": section("/timing/count", SCALARS, STATUS, "ticks in all"),
    "refused": section("/timing/refused", SCALARS, STATUS, "malformed messages that the controller refused, in all"),
}
POSITION_ERROR = section(
    "/timing/error/position", SCALARS, STATUS, "tracking error of each joint as the controller has it", "rad"
)
VELOCITY_ERROR = section(
    "/timing/error/velocity", SCALARS, STATUS, "tracking error of each joint as the controller has it", "rad/s"
)

section = partial(Entity, "Recorder")

STATES_MISSING = section("/recorder/states_missing", SCALARS, OWN, "gaps among the states, ticks in all")
COMMANDS_MISSING = section("/recorder/commands_missing", SCALARS, OWN, "gaps among the commands, ticks in all")
MALFORMED = section("/recorder/messages_malformed", SCALARS, OWN, "messages that could not be read, in all")

section = partial(Entity, "World")

WORLD = section("/world", "ViewCoordinates", OWN, "right-handed axes, z up", "m", static=True)
WORLD_SHAPE = section("/world/PART", SHAPES, OWN, "geometry that belongs to no body", "m", static=True)
SHAPE = section("/world/BODY/PART", SHAPES, OWN, "geometry of a body, in its frame", "m", static=True)
FIXED_BODY = section("/world/BODY", POSE, OWN, "pose of a body that no joint moves", "m", static=True)
BODY = section(
    "/world/BODY", POSE, (*STATE, *SCENE), "pose of each body that a joint moves; 100 Hz, without the arm 50 Hz", "m"
)
PUSH_ARROW = section(
    "/world/BODY/push", ARROWS, DISTURBANCE, "how the push on the body's joint moves the tool", "m", "a push"
)
TRAIL = section("/world/trail", LINES, STATE, "the last third of a second of the tool's path", "m")
PLANNED_PATH = section("/world/plan/path", LINES, PLAN, "the tool's planned path", "m", "a plan")
DEMONSTRATED_PATH = section("/world/plan/demonstration", LINES, PLAN, "the tool's demonstrated path", "m", "a plan")
PLANNED_HIT = section("/world/plan/hit", POINTS, PLAN, "where the tool is at the hit", "m", "a plan")
BALL_BODY = section("/world/ball", POSE, BALL, "the ball", "m", "a ball")
TEE = section("/world/tee", POSE, BALL, "the tee below the place where the ball first rests", "m", "a ball")
BALL_POSITION = section("/ball/position", SCALARS, BALL, "x, y, z of the ball", "m", "a ball")
BALL_VELOCITY = section("/ball/velocity", SCALARS, BALL, "x, y, z of the ball's velocity", "m/s", "a ball")
CONTACTS = section("/contacts", SCALARS, CONTACT, "impulse of each contact", "N·s", "a contact")

section = partial(Entity, "Strikes")

STRIKE_EVENT = section("/events/strike", EVENT, STRIKES, "the striker decides or sees something", needs="a strike")
STRIKE_LANE = section("/lanes/strike", LANE, STRIKES, "phase of the ball that the striker follows", needs="a strike")
PREDICTED_PATH = section("/world/strike/prediction", LINES, STRIKES, "where the ball will fly", "m", "a strike")
PREDICTED_BALL = section(
    "/world/strike/expected", "Ellipsoids3D", STRIKES, "the ball at the touch, two standard deviations", "m", "a strike"
)
PREDICTION_SPREAD = section(
    "/strikes/spread", SCALARS, STRIKES, "standard deviation of x, y, z of the ball at the touch", "m", "a strike"
)
CHOSEN_HIT = section(
    "/world/strike/racket", ARROWS, STRIKES, "the racket's velocity at the touch, 0.1 s of it", "m", "a strike"
)
REVISIONS = section("/strikes/revisions", SCALARS, STRIKES, "corrections taken for this ball", needs="a strike")
EXPECTED_ERROR = section(
    "/strikes/expected_error", SCALARS, STRIKES, "expected distance of the landing from the target", "m", "a strike"
)
OUTGOING = section(
    "/world/strike/outgoing", ARROWS, STRIKES, "velocity of the ball after the hit, 0.1 s of it", "m", "a returned ball"
)
STRIKE_TARGET = section("/world/strike/target", POINTS, STRIKES, "planned landing of the ball", "m", "a strike")
LANDING = section("/world/strike/landing", POINTS, STRIKES, "where the ball came down", "m", "a returned ball")
LANDING_DISTANCE = section(
    "/strikes/distance", SCALARS, STRIKES, "of the landing from the target", "m", "a returned ball"
)

ENTITIES: tuple[Entity, ...] = tuple(
    row
    for value in list(vars().values())
    for row in (value.values() if isinstance(value, dict) else (value,))
    if isinstance(row, Entity)
)
"""Every row above, in the order of the page."""
