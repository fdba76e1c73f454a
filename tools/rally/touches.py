"""What the arms may not touch: in a rally the ball alone is touched."""

from protocol.messages import Contact
from robot.court import BALL


def touched(contact: Contact) -> str:
    """Return a sentence for a contact without the ball, empty for one with it, and for the end of a contact."""
    if BALL in contact.bodies or contact.ended:
        return ""
    return f"{' and '.join(contact.bodies)} touched at {contact.time:.3f} s"
