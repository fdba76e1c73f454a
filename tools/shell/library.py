"""`volley primitives` and `forget`: the library of primitives."""

from protocol import messages as m
from tools.shell.flags import Name
from tools.shell.shell import Shared, reach


def primitives(*, shell: Shared) -> None:
    """List the library."""
    with reach(shell) as link:
        link.print(m.Primitives(primitives=link.arm.primitives()))


def forget(name: Name, *, shell: Shared) -> None:
    """Remove a primitive from the library.

    Args:
        name: Name of the primitive.
    """
    with reach(shell) as link:
        link.print(link.arm.forget(name))
