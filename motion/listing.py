"""Lists in sentences for people."""

from collections.abc import Sequence

LISTED = 5
"""Number of items that a sentence names; it counts the others."""


def listed(items: Sequence[object], most: int = LISTED) -> str:
    """Return the first items, separated by commas, and the number of the others."""
    first, others = ", ".join(map(str, items[:most])), len(items) - most
    return f"{first} and {others} more" if others > 0 else first
