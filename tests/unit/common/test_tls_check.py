"""An endpoint is open to other machines only with client certificates or `--insecure`."""

from pathlib import Path

import pytest
import zenoh

from deploy.zenoh import configure
from protocol.bus.sessions import session_config
from services.common.cli import Options, open_bus, refuse_exposure
from services.common.supervisor import command_lines
from services.common.tls_check import exposed_endpoints

ROUTER = Path(configure.__file__).parent / "router.json5"
EVERYWHERE = "tcp/0.0.0.0:7447"


@pytest.mark.parametrize(
    "endpoint",
    [
        "tcp/127.0.0.1:7447",
        "tcp/127.8.0.1:0",
        "tcp/[::1]:7447",
        "tcp/localhost:7447",
        "udp/127.0.0.1:7447?rel=0",
        "tls/localhost:7447",
        "unixsock-stream/volley.sock",
    ],
)
def test_endpoints_on_this_machine_are_not_exposed(endpoint):
    assert exposed_endpoints(session_config((), [endpoint], None)) == []


@pytest.mark.parametrize(
    "endpoint",
    [
        EVERYWHERE,
        "tcp/[::]:7447",
        "tcp/192.168.1.10:7447",
        "tcp/robot.local:7447",
        "tcp/localhost.example.org:7447",
        "udp/10.0.0.1:7447",
        "ws/0.0.0.0:80",
        "serial//dev/ttyS0",
        "tls/0.0.0.0:7447",
        "quic/10.0.0.1:7447",
    ],
)
def test_endpoints_for_other_machines_are_exposed(endpoint):
    assert exposed_endpoints(session_config((), ["tcp/127.0.0.1:7447", endpoint], None)) == [endpoint]


def test_endpoints_with_client_certificates_are_not_exposed():
    """Plain TCP beside them is still open, and so is an endpoint whose own settings do not require certificates."""
    open_ones = [EVERYWHERE, "tls/10.0.0.1:2#enable_mtls=false"]
    guarded = ["tls/0.0.0.0:7447", "quic/10.0.0.1:1#enable_mtls=true;so_rcvbuf=9"]
    assert exposed_endpoints(session_config((), [*guarded, *open_ones], ROUTER)) == open_ones
    assert exposed_endpoints(session_config((), (), ROUTER)) == []


@pytest.mark.parametrize(
    ("text", "exposed"),
    [
        ('{mode: "router"}', ["tcp/[::]:7447"]),
        ("{}", ["tcp/[::]:0"]),
        ('{mode: "client"}', []),
        ('{mode: "router", listen: {endpoints: {router: ["tcp/127.0.0.1:1"], peer: ["tcp/0.0.0.0:2"]}}}', []),
        ('{mode: "peer", listen: {endpoints: {peer: ["tcp/0.0.0.0:2"]}}}', ["tcp/0.0.0.0:2"]),
    ],
)
def test_zenohs_defaults_for_settings_missing_from_a_file_count(tmp_path, text, exposed):
    """Zenoh's default is to listen on all interfaces."""
    file = tmp_path / "zenoh.json5"
    file.write_text(text)
    assert exposed_endpoints(session_config((), (), file)) == exposed
    assert exposed_endpoints(session_config(("tcp/h:1",), (), file)) == []


def test_an_exposed_service_is_refused_with_the_reason():
    options = Options(listen=(EVERYWHERE,))
    for refused in (lambda: open_bus(options, "arm"), lambda: refuse_exposure(options, (), options.listen)):
        with pytest.raises(SystemExit, match=f"not listen on {EVERYWHERE}.*without a certificate.*--insecure"):
            refused()


def test_insecure_allows_an_exposed_service():
    options = Options(listen=("tcp/0.0.0.0:0",), insecure=True)
    open_bus(options, "arm").close()
    assert all("--insecure" in line for line in command_lines(options, {}).values())
    assert not any("--insecure" in line for line in command_lines(Options(), {}).values())


def test_sessions_bound_the_size_of_messages():
    config = session_config((), (), None)
    assert config.get_json("transport/link/rx/max_message_size") == str(32 << 20)
    with pytest.raises(zenoh.ZError):
        session_config((), (), Path("missing.json5"))
