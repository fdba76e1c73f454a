"""`python -m deploy.zenoh.certificates DIR`: a certificate authority and a certificate for every role, for a first try.

The authority's key is written beside the certificates, so this is for tests and first steps; a plant signs the same
common names with its own authority. Needs OpenSSL 3.
"""

import ipaddress
import subprocess
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from deploy.zenoh.configure import HOST_ROLE
from deploy.zenoh.permissions import ROLES, common_name

NEW_KEY = ("-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256", "-nodes")


@dataclass(frozen=True, slots=True)
class Authority:
    """Make ca.pem and, for every role, ROLE.pem and ROLE.key.

    Attributes:
        directory: Directory of the files; existing ones are overwritten.
        robot: Name of the robot; the common names are ROLE.ROBOT.
        hosts: Names and addresses at which the robot is reached.
        days: Validity of the certificates. Zenoh has no revocation: keep this short.
    """

    directory: Annotated[Path, tyro.conf.Positional]
    robot: str = "arm"
    hosts: tuple[str, ...] = ("robot.local", "localhost", "127.0.0.1")
    days: int = 30


def make_authority(authority: Authority) -> None:
    """Make the authority and the certificates of all roles; only their owner can read the keys.

    Raises:
        subprocess.CalledProcessError: openssl failed; its `stderr` says why.
    """
    authority.directory.mkdir(parents=True, exist_ok=True)
    extensions = ("basicConstraints=critical,CA:TRUE,pathlen:0", "keyUsage=critical,keyCertSign")
    _request(authority, "ca", f"volley test authority of {authority.robot}", extensions)
    for role in ROLES:
        make_certificate(authority, role.name, common_name(role.name, authority.robot))


def make_certificate(authority: Authority, file: str, name: str) -> None:
    """Sign a certificate for the common name `name`, as `file`.pem and `file`.key."""
    names = ",".join(f"{'IP' if _is_address(host) else 'DNS'}:{host}" for host in authority.hosts)
    leaf = ("basicConstraints=critical,CA:FALSE", "keyUsage=critical,digitalSignature")
    hosting = (*leaf, f"subjectAltName={names}", "extendedKeyUsage=serverAuth,clientAuth")
    joining = (*leaf, "extendedKeyUsage=clientAuth")
    signer = ("-CA", str(authority.directory / "ca.pem"), "-CAkey", str(authority.directory / "ca.key"))
    _request(authority, file, name, hosting if file == HOST_ROLE else joining, signer)


def _request(
    authority: Authority, file: str, name: str, extensions: tuple[str, ...], signer: tuple[str, ...] = ()
) -> None:
    key, certificate = authority.directory / f"{file}.key", authority.directory / f"{file}.pem"
    key.touch()
    key.chmod(0o600)
    command = ["openssl", "req", "-x509", *NEW_KEY, *signer, "-days", str(authority.days), "-subj", f"/CN={name}"]
    for extension in extensions:
        command += ["-addext", extension]
    subprocess.run([*command, "-keyout", key, "-out", certificate], check=True, capture_output=True, text=True)


def _is_address(host: str) -> bool:
    try:
        ipaddress.ip_address(host)
    except ValueError:
        return False
    return True


if __name__ == "__main__":
    make_authority(tyro.cli(Authority))
