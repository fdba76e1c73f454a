"""The planner's loop on a real bus: other requests are answered while a demonstration is learned."""

import logging
import threading
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace

import pytest

from protocol import messages as m
from protocol import topics
from protocol.bus.bus import Bus
from protocol.bus.sessions import open_session
from protocol.codec import matrix_bytes
from protocol.errors import Refusal
from robot.description import load_robot
from services.common.cli import free_endpoint
from services.planner.core import LeadTime, Planner
from services.planner.library import Arm, Library
from services.planner.loop import Loop
from tests.unit.planner.test_planner_learner import HeldWorker
from tests.unit.planner.test_planner_worker import PATH
from tools.drill.harness.waiting import eventually

LOG = logging.getLogger("planner")
ROBOT = load_robot()
ARM = Arm(ROBOT.name, ROBOT.joint_names)
LEARN = m.Learn(name="wave", positions=PATH.tolist(), rate=100.0)


@pytest.fixture
def served(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[SimpleNamespace]:
    """A client of a planner whose worker waits for permission to learn."""
    endpoint = free_endpoint()
    worker, stopping = HeldWorker(), threading.Event()
    monkeypatch.setattr("services.planner.loop.Worker", lambda *_: worker)
    with Bus(open_session(listen=[endpoint])) as bus, Bus(open_session(connect=[endpoint])) as client:
        library, lead = Library(tmp_path, ARM, LOG), LeadTime(ROBOT.tick)
        loop = Loop(bus, Planner(bus, ROBOT, library, lead, LOG), library, ROBOT, lead, LOG)
        thread = threading.Thread(target=loop.serve, args=(stopping,))
        thread.start()
        assert eventually(lambda: client.is_alive("planner"))
        yield SimpleNamespace(client=client, worker=worker)
        stopping.set()
        thread.join()


def names(client: Bus) -> list[str]:
    """Return the names of the planner's primitives."""
    return [entry.name for entry in client.ask(topics.PRIMITIVES, m.Empty()).primitives]


def test_requests_are_answered_while_a_demonstration_is_learned(served: SimpleNamespace):
    """Lists, `forget`, and `learn` requests that are refused at once."""
    answer = served.client.send(topics.LEARN, LEARN)
    while not served.worker.asked:
        assert names(served.client) == []
    for request, code in (
        (m.Learn(name="-", positions=[]), "bad_message"),
        (m.Forget(name="wave"), "unknown_primitive"),
    ):
        topic = topics.LEARN if isinstance(request, m.Learn) else topics.FORGET
        with pytest.raises(Refusal) as caught:
            served.client.ask(topic, request)
        assert caught.value.code == code
    assert names(served.client) == []
    served.worker.may.release()
    assert answer().samples == len(PATH)
    assert names(served.client) == ["wave"]


def test_demonstrations_as_rows_or_matrix_are_learned(served: SimpleNamespace):
    """A name in use is refused before learning."""
    for _ in range(2):
        served.worker.may.release()
    rows = served.client.ask(topics.LEARN, LEARN)
    matrix = m.Learn(name="again", positions=matrix_bytes(PATH), joint_count=2, rate=100.0)
    assert served.client.ask(topics.LEARN, matrix).position_max == rows.position_max
    with pytest.raises(Refusal) as caught:
        served.client.ask(topics.LEARN, LEARN)
    assert caught.value.code == "exists"
    assert len(served.worker.asked) == 2
