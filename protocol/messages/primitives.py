"""The library of primitives."""

from typing import Annotated, Literal

from msgspec import Meta, Struct, field

from protocol.messages.base import MAX_JOINTS, Message, Names, Number, Point, Request, Vector

Samples = Annotated[list[Annotated[Vector, Meta(max_length=MAX_JOINTS)]], Meta(max_length=1_000_000)]
"""Samples of a demonstration. Up to ten times too many are decoded, so that the planner can explain the refusal."""

MAX_SAMPLES = 100_000
"""Samples of a demonstration: 100 s at 1 kHz, or a minute and more of a slower arm."""

DURATION_RANGE = 0.01, 3600.0
"""Shortest and longest demonstration, s."""


class SavitzkyGolay(Struct, forbid_unknown_fields=True, kw_only=True):
    """The smoothing filter.

    Attributes:
        window_s: its length, s
        order: of its polynomial
    """

    window_s: Number
    order: int


class Learn(Request, kw_only=True):
    """Learn a primitive from a demonstration.

    Attributes:
        name: of the primitive, 1 to 64 letters, digits, - or _, the first a letter or digit
        positions: 10 to 100,000 samples, each an array of at most 64 joints; or a matrix, with `joint_count`
        joint_count: columns of the matrix
        joint_names: of the columns, in their order: those of the arm, in any order. Null: the arm's own, in its order
        rate: samples per second; this or `times`
        times: of the samples, s, not decreasing; samples with the same time are averaged
        smoothing: auto (a penalised spline, its penalty chosen by the noise), none, or this filter
        replace: overwrite a primitive of this name
        spread: standard deviation of several recordings around their mean, which is this demonstration, rad: 2 to 1001
            rows at even times, with a number for each joint, in the columns' order. Motions then stay near the
            positions at which it is small. null: all positions have the same weight
    """

    name: str
    positions: Samples | bytes
    joint_count: int | None = None
    joint_names: Names | None = None
    rate: Number | None = None
    times: Vector | None = None
    smoothing: Literal["auto", "none"] | SavitzkyGolay = "auto"
    replace: bool = False
    spread: Samples | None = None


class Learned(Message, kw_only=True):
    """The learned primitive.

    Attributes:
        name: of the primitive
        duration: of the demonstration
        basis_count: basis functions a joint
        fit_rms: standard error of the learned accelerations, or their rms distance from the filter's, rad/s² a joint
        noise_estimate: of the positions, rad a joint
        smoothing: the requested filter, null for a penalised spline or none
        position_rms: rms distance of the learned movement from its samples, rad a joint
        position_max: largest distance, rad a joint
        start: state in which the learned movement begins
        goal: state in which it ends
        samples: number of samples of the demonstration
        warnings: sentences about implausible properties of the recording, and about joints that were not learned well
    """

    name: str
    duration: Number
    basis_count: int
    fit_rms: Vector
    noise_estimate: Vector
    smoothing: SavitzkyGolay | None = None
    position_rms: Vector = field(default_factory=list)
    position_max: Vector = field(default_factory=list)
    start: Point | None = None
    goal: Point | None = None
    samples: int = 0
    warnings: list[str] = field(default_factory=list)


class PrimitiveEntry(Struct, kw_only=True):
    """One primitive of the library.

    Attributes:
        name: of the primitive
        joint_count: number of its joints
        duration: of the demonstration
        samples: number of samples of the demonstration
        created: Unix s
        robot: name of the robot that it was learned on, empty in a library of an earlier version
        joint_names: of the arm that it was learned on, empty in a library of an earlier version
    """

    name: str
    joint_count: int
    duration: Number
    samples: int
    created: Number
    robot: str = ""
    joint_names: Names = field(default_factory=list)


class Primitives(Message, kw_only=True):
    """The library, sorted by name."""

    primitives: list[PrimitiveEntry]


class Forget(Request, kw_only=True):
    """Remove a primitive from the library."""

    name: str


class Forgotten(Message, kw_only=True):
    """The primitive is gone."""

    name: str
