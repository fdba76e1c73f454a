"""The services of a system test.

`stack` is shared by the tests of a module. Before each test it starts a new run with the arm at home, and restarts the
processes that an earlier test ended. A test that needs other processes or another clock starts its own with
`harness.running`.
"""

from collections.abc import Iterator

import pytest
from cell import SecureCell
from harness import SERVICES, Stack, running, wait_for


@pytest.fixture(scope="module")
def services(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Stack]:
    """Start sim, planner, controller, and what the module's `ALSO` names, on the stepped clock, once for a module."""
    folder = tmp_path_factory.mktemp("services")
    names = (*SERVICES, *getattr(request.module, "ALSO", ()))
    with running(folder, names=names, learned=folder / "learned.json") as stack:
        yield stack


@pytest.fixture
def stack(services: Stack) -> Stack:
    """Return the module's services at the start of a new run; services that have ended are started again."""
    if ended := services.services.ended():
        services.start_again(*ended)
    services.reset()
    return services


@pytest.fixture(scope="module")
def survivors(services: Stack) -> Iterator[None]:
    """Check after all tests of the module that the services play a goal."""
    yield
    services.reset()
    assert services.finish(services.goal(duration=0.3)).outcome == "succeeded"


@pytest.fixture
def unharmed(stack: Stack, survivors: None) -> Iterator[None]:
    """Check after the test that every service lives and answers, and that the arm stands at home."""
    yield
    wait_for(stack.answers, "an answer from every service")
    assert stack.services.ended() == {}
    stack.step(20)
    assert stack.state().positions == pytest.approx(stack.home, abs=1e-6)


@pytest.fixture(scope="module")
def cell(tmp_path_factory: pytest.TempPathFactory) -> SecureCell:
    """Write the certificates and configurations of a cell."""
    return SecureCell(tmp_path_factory.mktemp("cell"))
