"""Check whether a Zenoh session accepts other machines without a certificate."""

import ipaddress
import json

import zenoh

LOCAL = ("unixsock-stream", "unixpipe")
ENCRYPTED = ("tls", "quic")


def exposed_endpoints(config: zenoh.Config) -> list[str]:
    """Return the endpoints on which a session of `config` accepts other machines without mutual TLS.

    Zenoh's default endpoints count too: as a router or a peer it listens on every interface.
    """
    mutual = json.loads(config.get_json("transport/link/tls/enable_mtls")) is True
    return [endpoint for endpoint in listening(config) if not _is_guarded(endpoint, mutual)]


def listening(config: zenoh.Config) -> list[str]:
    """Return the endpoints on which a session of `config` listens, configured or by default."""
    mode = json.loads(config.get_json("mode")) or "peer"
    endpoints = json.loads(config.get_json("listen/endpoints"))
    return endpoints.get(mode, []) if isinstance(endpoints, dict) else endpoints


def _is_guarded(endpoint: str, mutual: bool) -> bool:
    protocol, _, rest = endpoint.partition("/")
    address, _, settings = rest.partition("#")
    if protocol in LOCAL or _is_loopback(address.partition("?")[0].rpartition(":")[0]):
        return True
    own = settings.split(";")
    asks = "enable_mtls=true" in own or (mutual and "enable_mtls=false" not in own)
    return protocol in ENCRYPTED and asks


def _is_loopback(host: str) -> bool:
    try:
        return ipaddress.ip_address(host.strip("[]")).is_loopback
    except ValueError:
        return host == "localhost"
