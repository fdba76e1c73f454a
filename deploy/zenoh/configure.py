"""`python -m deploy.zenoh.configure`: write the Zenoh configurations of a robot cell, one for each participant.

`router.json5` is for the process that hosts the router (the robot side), `ROLE.json5` for the others.
"""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import tyro

from deploy.processes import PROCESSES
from deploy.zenoh.permissions import MESSAGES, ROLES, Permission, acting, common_name, reading
from protocol.bus.sessions import CLIENT, MAX_MESSAGE_BYTES
from protocol.topics import alive_key

HEADER = "// Made by: python -m deploy.zenoh.configure{flags}\n"
SERVICES = {role.name for role in ROLES if {alive_key(process.name) for process in PROCESSES} & set(role.tokens)}
HOST_ROLE = "robot"
"""Role whose certificate the router shows."""


@dataclass(frozen=True, slots=True)
class Cell:
    """Write router.json5 and a json5 file for every role into a directory.

    Attributes:
        out: Directory of the files; this package's own by default.
        robot: Name of the robot, as in its keys.
        host: Name or address at which the others reach the robot; the router's certificate must contain it.
        port: Port of the bus.
        tls: Directory of the certificates on the machines that use the files: ca.pem, ROLE.pem and ROLE.key.
    """

    out: Path = Path(__file__).parent
    robot: str = "arm"
    host: str = "robot.local"
    port: int = 7447
    tls: Path = Path("/etc/volley/tls")


def router_config(cell: Cell) -> dict[str, Any]:
    """Return the configuration of the router: mutual TLS only, and the permission table."""
    return {
        "mode": "router",
        "listen": {"endpoints": [f"tls/0.0.0.0:{cell.port}"]},
        "transport": _transport(
            cell,
            {
                "enable_mtls": True,
                "listen_certificate": str(cell.tls / f"{HOST_ROLE}.pem"),
                "listen_private_key": str(cell.tls / f"{HOST_ROLE}.key"),
            },
            {},
        ),
        "access_control": access_control(cell.robot),
    }


def client_config(cell: Cell, role: str) -> dict[str, Any]:
    """Return the configuration of a participant that joins the bus as `role`."""
    return {
        "mode": "client",
        "connect": {"endpoints": [f"tls/{cell.host}:{cell.port}"]},
        "listen": {"endpoints": []},
        "transport": _transport(
            cell,
            {
                "enable_mtls": True,  # without it the certificate is not shown
                "verify_name_on_connect": True,
                "connect_certificate": str(cell.tls / f"{role}.pem"),
                "connect_private_key": str(cell.tls / f"{role}.key"),
            },
            {} if role in SERVICES else {"tx": {"lease": CLIENT.lease_ms}},  # services set their own
        ),
    }


def _transport(cell: Cell, own: dict[str, Any], more: dict[str, Any]) -> dict[str, Any]:
    tls = {"root_ca_certificate": str(cell.tls / "ca.pem"), "close_link_on_expiration": True, **own}
    return {"link": {"protocols": ["tls"], "rx": {"max_message_size": MAX_MESSAGE_BYTES}, **more, "tls": tls}}


def access_control(robot: str) -> dict[str, Any]:
    """Return the permission table as a configuration of Zenoh's access control.

    A message is checked where it enters the router. What has entered may leave to every known role, since a participant
    only receives what it was allowed to subscribe to or to answer.
    """
    rules = [_rule("leave", "egress", Permission(MESSAGES, ("**",)), robot)]
    rules += [_rule(f"all-{p.messages[0]}", "ingress", p, robot) for p in reading()]
    shared = [rule["id"] for rule in rules]
    subjects, policies = [], []
    for role in ROLES:
        own = [_rule(f"{role.name}-{p.messages[0]}", "ingress", p, robot) for p in acting(role)]
        rules += own
        subjects.append({"id": role.name, "cert_common_names": [common_name(role.name, robot)]})
        policies.append({"subjects": [role.name], "rules": [*shared, *(rule["id"] for rule in own)]})
    table = {"rules": rules, "subjects": subjects, "policies": policies}
    return {"enabled": True, "default_permission": "deny", **table}


def _rule(name: str, flow: str, permission: Permission, robot: str) -> dict[str, Any]:
    keys = [f"volley/{robot}/{key}" for key in permission.keys]
    messages = list(permission.messages)
    return {"id": name, "permission": "allow", "flows": [flow], "messages": messages, "key_exprs": keys}


def texts(cell: Cell) -> dict[str, str]:
    """Return the text of every file, by file name."""
    configs = {"router": router_config(cell), **{role.name: client_config(cell, role.name) for role in ROLES}}
    default = Cell()
    differing = [name for name in ("robot", "host", "port", "tls") if getattr(cell, name) != getattr(default, name)]
    header = HEADER.format(flags="".join(f" --{name} {getattr(cell, name)}" for name in differing))
    return {f"{name}.json5": header + json.dumps(config, indent=2) + "\n" for name, config in configs.items()}


def write(cell: Cell) -> None:
    """Write the files; the directory is made if it is missing."""
    cell.out.mkdir(parents=True, exist_ok=True)
    for name, text in texts(cell).items():
        (cell.out / name).write_text(text)


if __name__ == "__main__":
    write(tyro.cli(Cell))
