"""Detect contacts and tracking errors during a motion."""

import numpy as np

from protocol import messages as m
from robot.conversions import unit_of
from robot.description import RobotConfig


def touch_of(contact: m.Contact, config: RobotConfig) -> m.FirstContact | None:
    """Return a contact from the arm's side, or None if the arm is not involved."""
    own = [body for body in contact.bodies if body in config.bodies]
    if not own or len(contact.bodies) != 2:
        return None
    first, second = contact.bodies
    return m.FirstContact(body=own[0], other=second if own[0] == first else first, time=contact.time)


def lost_track(errors: np.ndarray, result: m.Result | None, config: RobotConfig, recoils: bool) -> str | None:
    """Return a sentence about the joint that is too far from its reference, or None.

    errors: (J,), rad. result: of the running goal. recoils: whether a recoil would be accepted now.
    """
    worst = int(errors.argmax())
    if errors[worst] <= config.max_tracking_error:
        return None
    recoil = config.recoil if recoils else None
    touch = result.first_contact if result else None
    unit = unit_of("position", config.slides[worst])
    return (
        f"{config.joint_names[worst]} is {errors[worst]:.4g} {unit} from its reference, more than "
        f"max_tracking_error = {config.max_tracking_error} {unit}"
        + (f" and beyond the recoil of {recoil.positions:g} rad and {recoil.velocities:g} rad/s" if recoil else "")
        + (f"; {touch.body} touched {touch.other} at {touch.time:.3f} s" if touch else "")
    )
