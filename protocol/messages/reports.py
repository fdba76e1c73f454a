"""The report of a plan, a part of the reply to a goal."""

from typing import Literal

from msgspec import Struct

from protocol.messages.base import Clearance, Number, PartialVector, Range, Vector


class FinalError(Struct, kw_only=True):
    """Distance of the plan's end from the requested one, recomputed from the solution: rad, rad/s."""

    positions: Vector
    velocities: Vector


class ActiveLimit(Struct, kw_only=True):
    """A limit that shapes the plan.

    Attributes:
        joint: its name
        quantity: position, velocity, acceleration or jerk
        time_from_start: time at which it is active
    """

    joint: str
    quantity: str
    time_from_start: Number


class Extremes(Struct, kw_only=True):
    """[min, max] of each joint over the whole motion, between samples included."""

    positions: list[Range]
    velocities: list[Range]
    accelerations: list[Range]
    jerks: list[Range]


class Margin(Struct, kw_only=True):
    """Smallest distance of each joint from its limits; null: no limit."""

    positions: PartialVector
    velocities: PartialVector
    accelerations: PartialVector
    jerks: PartialVector


class Distance(Struct, kw_only=True):
    """Distance between two curves over the whole motion, rad, one value a joint.

    Attributes:
        rms: root mean square
        max: largest
    """

    rms: Vector
    max: Vector


class Deviation(Struct, kw_only=True):
    """Distance of the plan from the demonstration and from the plan without limits.

    Attributes:
        from_demonstration: from the demonstrated positions, in the motion's own time
        by_limits: from the same plan without limits
    """

    from_demonstration: Distance
    by_limits: Distance


class Report(Struct, kw_only=True):
    """Properties of a plan, recomputed from the solution.

    Attributes:
        imitation_rms: root mean square of g̈ − τ²d̈ over the motion, rad/s² a joint
        deviation: from the demonstration and by the limits, null if it was not computed
        phase: phase of the demonstration at which the motion begins: 0, or the phase that the corrected motion had
            reached
        basis_count: basis functions a joint, 0 if it is not reported
        final_error: distance of the plan's end from the requested one
        extremes: [min, max] of each quantity over all time, tail included
        margin: smallest distance from each limit, null: no limit
        active: the limits that shape the plan
        certified: the limits of positions, velocities, accelerations and jerks hold at all times, between samples
            included; this does not cover collisions and torques
        checked: whether the goal's `checks` were done: `none` if the goal requests none. Earlier planners reported
            `part` for a correction whose time ran out
        torque_use: largest torque of each joint over the motion and its stop, as a part of its limit; null without a
            limit; null as a whole if it was not checked
        clearance: null if it was not checked, or nothing can collide
        solve_ms: time spent on the quadratic programs of all joints
        rounds: of constraint generation, the most of any joint
        rows: limit rows in the last program, the most of any joint
    """

    imitation_rms: Vector
    deviation: Deviation | None = None
    phase: Number = 0.0
    basis_count: int = 0
    final_error: FinalError
    extremes: Extremes
    margin: Margin
    active: list[ActiveLimit]
    certified: bool
    checked: Literal["all", "part", "none"] = "none"
    torque_use: PartialVector | None = None
    clearance: Clearance | None = None
    solve_ms: Number
    rounds: int
    rows: int
