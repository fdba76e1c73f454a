"""Forbidden contacts: those without the ball."""

from protocol.messages import Contact
from robot.court import BALL


def forbidden_contact(contact: Contact) -> str:
    """Return a sentence for the start of a contact without the ball; empty for other contacts."""
    if BALL in contact.bodies or contact.ended:
        return ""
    return f"{' and '.join(contact.bodies)} touched at {contact.time:.3f} s"
