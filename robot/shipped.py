"""The robot and the demonstrations that ship with Volley."""

from pathlib import Path

_DEPLOY = Path(__file__).resolve().parents[1] / "deploy"

DEFAULT_ROBOT_CONFIG = _DEPLOY / "robots" / "arm.toml"
"""The default robot."""

DEMONSTRATIONS = _DEPLOY / "demonstrations"
"""CSV files with one demonstration each, which a new library learns."""
