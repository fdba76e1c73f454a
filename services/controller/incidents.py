"""What the controller notices of a motion that goes wrong."""

import numpy as np

from protocol import messages as m
from robot.description import RobotConfig


def touch_of(contact: m.Contact, config: RobotConfig) -> m.FirstContact | None:
    """Return a contact as one of the arm's, or None where the arm has no part in it."""
    own = [body for body in contact.bodies if body in config.bodies]
    if not own or len(contact.bodies) != 2:
        return None
    first, second = contact.bodies
    return m.FirstContact(body=own[0], other=second if own[0] == first else first, time=contact.time)


def lost_track(errors: np.ndarray, result: m.Result | None, config: RobotConfig, recoils: bool) -> str | None:
    """Return a sentence on the joint that is too far from its reference, None where none is.

    errors: (J,), rad. result: of the goal under way. recoils: whether a recoil would be accepted now.
    """
    worst = int(errors.argmax())
    if errors[worst] <= config.max_tracking_error:
        return None
    recoil = config.recoil if recoils else None
    touch = result.first_contact if result else None
    return (
        f"{config.joint_names[worst]} is {errors[worst]:.3f} rad from its reference, more than "
        f"max_tracking_error = {config.max_tracking_error} rad"
        + (f" and beyond the recoil of {recoil.positions:g} rad and {recoil.velocities:g} rad/s" if recoil else "")
        + (f"; {touch.body} touched {touch.other} at {touch.time:.3f} s" if touch else "")
    )
