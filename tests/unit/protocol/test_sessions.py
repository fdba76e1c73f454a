"""Timeouts and queues of sessions whose peer is suspended, and errors of configurations."""

import signal
import socket
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest
import zenoh

from protocol.bus.sessions import (
    BLOCKED_US,
    CLIENT,
    CLIENT_BLOCKED_US,
    RECORDER,
    SERVICE,
    SessionTimeouts,
    open_session,
    session_config,
)
from services.common.cli import free_endpoint
from tests.connections import connections, port_of
from tools.drill.harness.waiting import PATIENCE_S, eventually

LISTENER = """
import sys, time, zenoh
from protocol.bus.sessions import RECORDER, open_session
with open_session([sys.argv[1]], timeouts=RECORDER) as session:
    received = session.declare_subscriber("stream", zenoh.handlers.RingChannel(1 << 14))
    session.put("ready", b"")
    sys.stdin.readline()
    count, end = 0, time.monotonic() + 60.0
    while count < int(sys.argv[2]) and time.monotonic() < end:
        count += received.try_recv() is not None
    print(count, flush=True)
"""
COUNT, BODY = 2000, bytes(3000)


@pytest.mark.parametrize(
    ("setting", "sentence"),
    [
        (None, "FILE is not a Zenoh configuration: No such file or directory (os error 2)"),
        ('{mode: "blob"}', "FILE is not a Zenoh configuration: unknown variant `blob`, expected one of `router`"),
    ],
)
def test_an_unreadable_configuration_is_an_error_with_its_path(tmp_path: Path, setting: str | None, sentence: str):
    """Without references to Zenoh's source code."""
    file = tmp_path / "cell.json5"
    if setting:
        file.write_text(setting)
    with pytest.raises(zenoh.ZError) as error:
        open_session(config_file=file)
    assert str(error.value).startswith(sentence.replace("FILE", str(file)))
    assert ".rs:" not in str(error.value)


def test_invalid_endpoints_are_errors_in_one_sentence():
    with pytest.raises(zenoh.ZError, match=r"^Endpoints must be of the form .*: x$"):
        open_session(["x"])
    with pytest.raises(zenoh.ZError, match=r"^Can not create a new TCP listener .*\(os error 99\)\]$"):
        open_session(listen=["tcp/192.0.2.1:7447"])


def test_the_backlog_sets_the_sockets_receive_buffer():
    timeouts = SessionTimeouts(lease_ms=2000, backlog_bytes=100_000)
    endpoint = free_endpoint()
    with open_session(listen=[endpoint]), open_session([endpoint], timeouts=timeouts):
        kept = [each.getsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF) for each in connections(port_of(endpoint))]
    assert 200_000 in kept  # the kernel doubles the requested value


def test_a_backlog_beyond_the_kernels_limit_is_not_requested():
    too_much = SessionTimeouts(lease_ms=2000, backlog_bytes=1 << 30)
    assert not too_much.is_granted
    for timeouts in (too_much, CLIENT):
        assert session_config((), (), None, timeouts).get_json("transport/link/tcp/so_rcvbuf") == "null"


@pytest.mark.skipif(not RECORDER.is_granted, reason="net.core.rmem_max is too small for a recorder's backlog")
def test_messages_to_a_suspended_recorder_are_kept():
    """6 MB, published in about ten seconds; if the publisher blocked, it would close the connection."""
    endpoint = free_endpoint()
    with open_session(listen=[endpoint]) as session:
        ready = session.declare_subscriber("ready", zenoh.handlers.FifoChannel(1))
        stream = session.declare_publisher("stream", congestion_control=zenoh.CongestionControl.BLOCK)
        listener = subprocess.Popen(
            [sys.executable, "-c", LISTENER, endpoint, str(COUNT)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        try:
            assert eventually(lambda: ready.try_recv() is not None)
            listener.send_signal(signal.SIGSTOP)
            for _ in range(COUNT):
                stream.put(BODY)
            listener.send_signal(signal.SIGCONT)
            count, _ = listener.communicate("\n")
        finally:
            listener.kill()
            listener.communicate()
    assert int(count) == COUNT


def test_a_suspended_subscriber_blocks_a_publisher_only_once():
    """After one timeout its connection is closed, so a debugger that stops it does not stop the publisher."""
    endpoint = free_endpoint()
    with open_session(listen=[endpoint]) as session:
        ready = session.declare_subscriber("ready", zenoh.handlers.FifoChannel(1))
        stream = session.declare_publisher("stream", congestion_control=zenoh.CongestionControl.BLOCK)
        listener = subprocess.Popen([sys.executable, "-c", LISTENER, endpoint, "0"], stdin=subprocess.PIPE)
        try:
            assert eventually(lambda: ready.try_recv() is not None)
            listener.send_signal(signal.SIGSTOP)
            began = time.monotonic()
            for _ in range(20):
                stream.put(bytes(1 << 20))
            assert time.monotonic() - began < CLIENT_BLOCKED_US / 1e6
        finally:
            listener.kill()
            listener.communicate()


ROUTER = """
import sys, zenoh
from protocol.bus.sessions import SERVICE, open_session
def answer(query):
    with query:
        query.reply(query.key_expr, str(len(query.payload)))
with open_session(listen=[sys.argv[1]], timeouts=SERVICE) as session:
    kept = session.declare_queryable("ask", answer)
    print("ready", flush=True)
    sys.stdin.readline()
"""


def test_a_router_blocks_for_a_shorter_time_than_a_client(tmp_path: Path):
    """Also if it is a router by its configuration file."""
    file = tmp_path / "router.json5"
    file.write_text('{mode: "router", listen: {endpoints: ["tcp/127.0.0.1:0"]}}')
    key = "transport/link/tx/queue/congestion_control/block/wait_before_close"
    for router in (session_config((), ("tcp/127.0.0.1:0",), None), session_config((), (), file)):
        assert int(router.get_json(key)) == BLOCKED_US
    assert int(session_config(("tcp/127.0.0.1:1",), (), None).get_json(key)) > BLOCKED_US


def test_a_large_request_survives_a_router_that_stalls():
    """On a busy machine a router may read nothing for 1 s, so a client's timeout is longer."""
    endpoint, body = free_endpoint(), bytes(16 << 20)
    line = [sys.executable, "-c", ROUTER, endpoint]
    with subprocess.Popen(line, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as router:
        assert router.stdout is not None
        assert router.stdout.readline() == "ready\n"
        with open_session([endpoint], timeouts=SERVICE) as session:
            router.send_signal(signal.SIGSTOP)
            stalled = threading.Timer(1.5, router.send_signal, [signal.SIGCONT])
            stalled.start()
            (reply,) = session.get("ask", payload=body, timeout=PATIENCE_S)
            stalled.join()
            assert reply.ok is not None
            assert int(reply.ok.payload.to_string()) == len(body)
        router.communicate("\n")


def test_real_time_queues_hold_16_messages():
    """With Zenoh's default of two, the drill's suspended recorder loses messages."""
    assert session_config((), (), None).get_json("transport/link/tx/queue/size/real_time") == "16"
