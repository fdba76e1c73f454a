"""The permission table of a robot cell, and the files made from it."""

import subprocess
from pathlib import Path

import pytest
import zenoh

from deploy.processes import PROCESSES
from deploy.zenoh import configure
from deploy.zenoh.certificates import Authority, make_authority
from deploy.zenoh.configure import SERVICES, Cell, access_control
from deploy.zenoh.permissions import MESSAGES, OPERATING, ROLES, SIMULATING, STRIKING, acting, reading
from protocol import topics
from protocol.topics import ROBOT_SIDE

DIRECTORY = Path(configure.__file__).parent
BY_NAME = {role.name: role for role in ROLES}
READERS = {"recorder", "viewer"}


def may(role: str, message: str, key: str) -> bool:
    """Return whether the table lets `role` send `message` on `key`."""
    permissions = (*reading(), *acting(BY_NAME[role]))
    return any(message in permission.messages and key in permission.keys for permission in permissions)


def senders(message: str, key: str) -> set[str]:
    """Return the roles that may send `message` on `key`."""
    return {role.name for role in ROLES if may(role.name, message, key)}


def test_every_process_has_a_role():
    assert {process.name for process in PROCESSES} - {ROBOT_SIDE} | {"robot"} == SERVICES


@pytest.mark.parametrize("topic", topics.PUBLICATIONS, ids=lambda topic: topic.key)
def test_only_the_owner_publishes(topic):
    assert senders("put", topic.key) == {topic.owner}
    assert senders("declare_subscriber", topic.key) == set(BY_NAME)


@pytest.mark.parametrize("topic", topics.QUERIES, ids=lambda topic: topic.key)
def test_only_the_owner_answers(topic):
    assert senders("reply", topic.key) == senders("declare_queryable", topic.key) == {topic.owner}
    assert not topic.reads or senders("query", topic.key) == set(BY_NAME)


def test_who_may_ask_for_a_change():
    asked = {topic.key: senders("query", topic.key) for topic in topics.QUERIES if not topic.reads}
    assert asked.pop("execute") == {"planner"}
    assert (asked["goal"], asked["cancel"]) == ({"operator", "tester", "striker"},) * 2
    assert {frozenset(asked.pop(topic.key) - {"striker"}) for topic in OPERATING} == {frozenset({"operator", "tester"})}
    assert [asked.pop(topic.key) for topic in STRIKING] == [{"operator", "tester"}] * 2
    assert asked == {topic.key: {"tester"} for topic in SIMULATING}


def test_readers_only_read():
    for name in READERS:
        assert {message for permission in acting(BY_NAME[name]) for message in permission.messages} <= {
            "liveliness_token"
        }


def test_no_role_may_delete_and_every_other_message_is_granted():
    granted = {m for role in ROLES for permission in (*reading(), *acting(role)) for m in permission.messages}
    assert granted == set(MESSAGES) - {"delete"}


def test_access_control_denies_by_default_and_names_every_role():
    table = access_control("arm")
    assert (table["enabled"], table["default_permission"]) == (True, "deny")
    assert [subject["cert_common_names"] for subject in table["subjects"]] == [[f"{name}.arm"] for name in BY_NAME]
    used = {rule for policy in table["policies"] for rule in policy["rules"]}
    assert used == {rule["id"] for rule in table["rules"]}
    assert all(key.startswith("volley/arm/") for rule in table["rules"] for key in rule["key_exprs"])


@pytest.mark.parametrize(("name", "text"), configure.texts(Cell()).items())
def test_committed_files_are_the_generated_ones(name, text):
    assert (DIRECTORY / name).read_text() == text, "run: python -m deploy.zenoh.configure"
    zenoh.Config.from_file(DIRECTORY / name)  # raises for fields that this Zenoh does not know


def test_no_other_configuration_is_committed():
    assert {path.name for path in DIRECTORY.glob("*.json5")} == set(configure.texts(Cell()))


def test_configurations_of_another_cell_are_generated(tmp_path):
    cell = Cell(out=tmp_path / "leg", robot="leg", host="10.0.0.7", port=7448, tls=Path("/opt/tls"))
    configure.write(cell)
    router = zenoh.Config.from_file(cell.out / "router.json5")
    assert router.get_json("listen/endpoints") == '["tls/0.0.0.0:7448"]'
    assert '"planner.leg"' in router.get_json("access_control")
    planner = zenoh.Config.from_file(cell.out / "planner.json5")
    assert planner.get_json("connect/endpoints") == '["tls/10.0.0.7:7448"]'
    assert planner.get_json("transport/link/tls/connect_private_key") == '"/opt/tls/planner.key"'
    command = (cell.out / "viewer.json5").read_text().splitlines()[0]
    assert command.endswith("--robot leg --host 10.0.0.7 --port 7448 --tls /opt/tls")


def test_certificates_say_who_and_cannot_sign(tmp_path):
    make_authority(Authority(tmp_path, robot="leg", hosts=("leg.local", "10.0.0.7"), days=1))
    for role in BY_NAME:
        text = openssl("x509", "-in", tmp_path / f"{role}.pem", "-noout", "-text")
        assert f"Subject: CN = {role}.leg\n" in text
        assert "CA:FALSE" in text
        assert ("DNS:leg.local, IP Address:10.0.0.7" in text) == (role == "robot")
        assert openssl("verify", "-CAfile", tmp_path / "ca.pem", tmp_path / f"{role}.pem").endswith("OK\n")
        assert (tmp_path / f"{role}.key").stat().st_mode & 0o777 == 0o600


def openssl(*arguments: str | Path) -> str:
    """Return what openssl prints."""
    return subprocess.run(["openssl", *arguments], check=True, capture_output=True, text=True).stdout
