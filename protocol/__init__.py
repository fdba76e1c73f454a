"""The wire contract as data: topics, messages, codec, errors. `protocol.bus` carries them over Zenoh."""

__version__ = "0.1.0"
"""Version of Volley, read by pyproject.toml. The version of the contract is in every message."""
