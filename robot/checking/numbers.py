"""Checks of limits and gains."""

from collections.abc import Iterator

import numpy as np

from robot.checking.subject import Finding, Subject

HIGH_GAIN = 0.5
"""alpha·tick above which the response to a push rings; eq. 11 is unstable above 2."""
MANY_TURNS = 4 * np.pi
"""Largest plausible end of a range, rad."""
NARROW = 0.2
"""A range narrower than this (rad) was probably in radians, and read as degrees: a whole turn is 0.11 rad then."""
FAST = 60.0
"""rad/s."""
TIGHT = 0.9
RUBS = 0.3
"""Fraction of the torque limit that friction may take without a warning."""


def gravity(subject: Subject) -> Iterator[Finding]:
    """Find torque limits that are too low to hold the arm."""
    config = subject.config
    use = np.abs(subject.load_at_home.gravity[0]) / config.torques
    for index in np.flatnonzero(use > TIGHT):
        needed = abs(subject.load_at_home.gravity[0, index])
        name, limit = config.joint_names[index], config.torques[index]
        level, verb = ("unusable", "cannot hold") if use[index] > 1 else ("warning", "hardly holds")
        yield Finding(
            level,
            f"{name} {verb} the arm at home: gravity takes {needed:.3g} of {limit:.3g} N·m; "
            "choose another home, or correct its torque limit or the masses in the model",
        )
    parts = np.abs(subject.load.gravity) / config.torques
    for index in np.flatnonzero((parts > 1).any(axis=0) & (use <= TIGHT)):
        share = (parts[:, index] > 1).mean()
        yield Finding(
            "warning",
            f"{config.joint_names[index]} cannot hold the arm in {share:.0%} of its range, where gravity takes "
            f"up to {parts[:, index].max() * config.torques[index]:.3g} of {config.torques[index]:.3g} N·m; "
            "tighten joints.positions",
        )


def friction(subject: Subject) -> Iterator[Finding]:
    """Find joints with dry friction, and its effect."""
    config, model = subject.config, subject.model
    rubbing = model.dof_frictionloss[model.jnt_dofadr[subject.joints]]
    if not rubbing.any():
        return
    errors = rubbing / (np.diagonal(subject.load_at_home.inertia[0]) * config.alpha**2 / 4)
    index = int(np.argmax(errors))
    name, error, part = config.joint_names[index], errors[index], rubbing[index] / config.torques[index]
    rubs = f"{name} rubs with {rubbing[index]:.3g} N·m" + (f", {part:.1%} of its torque" if part else "")
    if error > config.max_tracking_error or part > RUBS:
        yield Finding(
            "warning",
            f"{rubs}, which outweighs what its link weighs: uncompensated friction would leave it {error:.2g} rad "
            "from its reference; give the joint its rotor's inertia in the model (armature, kg·m²), or a larger alpha",
        )
    else:
        yield Finding(
            "note",
            f"{rubs}; without compensation a hit would be off by up to {error:.2g} rad, less with a larger alpha",
        )


def gain(subject: Subject) -> Iterator[Finding]:
    """Find a gain that rings."""
    config = subject.config
    product = config.alpha * config.tick
    if product > HIGH_GAIN:
        yield Finding(
            "warning",
            f"alpha of {config.alpha:g} is {product:.2g} a tick, so that a push rings; write at most "
            f"{HIGH_GAIN * config.rate_hz:g}, or raise rate_hz",
        )


def missing_limits(subject: Subject) -> Iterator[Finding]:
    """Find missing limits."""
    config = subject.config
    rows = (
        ("range", np.isfinite(config.limits.positions).all(axis=1), "joints.positions"),
        ("torque limit", np.isfinite(config.torques), "joints.torques"),
        ("velocity limit", np.isfinite(config.limits.velocities), "joints.velocities"),
        ("acceleration limit", np.isfinite(config.limits.accelerations), "joints.accelerations"),
        ("jerk limit", np.isfinite(config.limits.jerks), "joints.jerks"),
    )
    for what, known, key in rows:
        missing = [config.joint_names[index] for index in np.flatnonzero(~known)]
        if missing:
            who = ", ".join(missing) if len(missing) < config.joint_count else "any joint"
            yield Finding("warning", f"no {what} of {who} is known, so none is kept; write {key} from the data sheet")


def swapped_ranges(subject: Subject) -> Iterator[Finding]:
    """Find ranges whose end is below their beginning, which MuJoCo ignores."""
    model = subject.model
    for name, joint in zip(subject.config.joint_names, subject.joints, strict=True):
        low, high = model.jnt_range[joint]
        if low > high:
            yield Finding(
                "warning",
                f"{name}: its range begins at {low:g} and ends at {high:g}, so none is kept; exchange the two",
            )


def degrees(subject: Subject) -> Iterator[Finding]:
    """Find angles in the wrong unit."""
    config = subject.config
    hinges = [index for index in range(config.joint_count) if not subject.is_slide(index)]
    ranges = np.where(np.isfinite(config.limits.positions), config.limits.positions, 0.0)
    for index in hinges:
        low, high = ranges[index]
        if max(abs(low), abs(high)) > MANY_TURNS:
            yield Finding(
                "warning",
                f"{config.joint_names[index]}: its range of {low:g} to {high:g} rad looks like degrees, which are "
                f"{np.deg2rad(low):.3g} to {np.deg2rad(high):.3g} rad; a URDF is in radians, an MJCF in radians needs "
                '<compiler angle="radian"/>',
            )
        if FAST < config.limits.velocities[index] < np.inf:
            yield Finding(
                "warning",
                f"{config.joint_names[index]}: a velocity limit of {config.limits.velocities[index]:g} looks like "
                f"degrees; {np.deg2rad(config.limits.velocities[index]):.3g} rad/s is the same",
            )
    widths = {config.joint_names[index]: ranges[index, 1] - ranges[index, 0] for index in hinges}
    narrow = {name: width for name, width in widths.items() if 0 < width < NARROW}
    if narrow and len(narrow) == len(widths):
        yield Finding(
            "unusable",
            f"no joint moves more than {max(narrow.values()):.2g} rad: the model's radians were read as degrees; "
            'write <compiler angle="radian"/>',
        )
    elif narrow:
        yield Finding(
            "warning",
            f"{', '.join(narrow)}: a range narrower than {NARROW:g} rad looks like radians that were read as degrees; "
            "write all ranges of the model in the unit of its <compiler angle>",
        )
