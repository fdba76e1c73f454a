"""The library of primitives."""

from typing import Annotated, Literal

from msgspec import Meta, Struct, field

from protocol.messages.base import MAX_JOINTS, Message, Number, Point, Request, Vector

Samples = Annotated[list[Annotated[Vector, Meta(max_length=MAX_JOINTS)]], Meta(max_length=1_000_000)]
"""Of a demonstration; the planner says it better where it is only ten times too many."""


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
        rate: samples per second; this or `times`
        times: of the samples, s, rising
        smoothing: auto (a penalised spline, by the noise found), none, or this filter
        replace: overwrite a primitive of this name
    """

    name: str
    positions: Samples | bytes
    joint_count: int | None = None
    rate: Number | None = None
    times: Vector | None = None
    smoothing: Literal["auto", "none"] | SavitzkyGolay = "auto"
    replace: bool = False


class Learned(Message, kw_only=True):
    """What was learned.

    Attributes:
        name: of the primitive
        duration: of the demonstration
        basis_count: splines a joint
        fit_rms: standard error of the learned accelerations, or rms against an explicit filter's, rad/s² a joint
        noise_estimate: of the positions, rad a joint
        smoothing: the filter that was asked for, null for a penalised spline or none
        position_rms: between the learned movement and its samples, rad a joint
        position_max: the largest of these distances, rad a joint
        start: where the learned movement begins
        goal: where it ends
        samples: of the demonstration
        warnings: sentences on what is odd about the recording, or was not learned well
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
        name: to ask for it
        joint_count: its joints
        duration: of the demonstration
        samples: of the demonstration
        created: Unix s
    """

    name: str
    joint_count: int
    duration: Number
    samples: int
    created: Number


class Primitives(Message, kw_only=True):
    """The library, by name."""

    primitives: list[PrimitiveEntry]


class Forget(Request, kw_only=True):
    """Remove a primitive from the library."""

    name: str


class Forgotten(Message, kw_only=True):
    """The primitive is gone."""

    name: str
