"""The services of a system test.

Modules that follow each other share `stack`: starting services takes longer than most tests. Before each module their
library has the shipped motion alone; before each test a new run begins with the arm at home, and processes that an
earlier test ended are started again. A test that needs other processes or another clock starts its own with
`harness.running`.
"""

from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from types import ModuleType

import pytest
from cell import SecureCell
from harness import SERVICES, Stack, running, wait_for

from protocol import messages as m
from protocol import topics

SHIPPED = "forehand"


class SharedServices:
    """Services on the stepped clock that run until other ones are needed."""

    def __init__(self) -> None:
        self._ends = ExitStack()
        self._names: tuple[str, ...] = ()
        self._stack: Stack | None = None

    def start(self, names: tuple[str, ...], folder: Path) -> Stack:
        """Return the running services if they have these names; otherwise end them and start others."""
        if self._stack is None or names != self._names:
            self.end()
            self._stack = self._ends.enter_context(running(folder, names, learned=folder / "learned.json"))
            self._names = names
        return self._stack

    def end(self) -> None:
        """End the services."""
        self._stack = None
        self._ends.close()


SHARED = SharedServices()
SHARING: dict[Path, tuple[str, ...]] = {}
"""Files whose tests share services, and the names of these services."""


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Move the files that share services to the front, those with equal services next to each other."""
    for item in items:
        if "shared_services" in getattr(item, "fixturenames", ()):
            SHARING[item.path] = names_for(getattr(item, "module", None))
    items.sort(key=lambda item: (item.path not in SHARING, SHARING.get(item.path, ())))


@pytest.hookimpl(trylast=True)
def pytest_runtest_teardown(nextitem: pytest.Item | None) -> None:
    """End the shared services if the next file does not need them: an idle controller takes 6 % of a core."""
    if nextitem is None or nextitem.path not in SHARING:
        SHARED.end()


def pytest_sessionfinish() -> None:
    """End the shared services if the session was interrupted."""
    SHARED.end()


def names_for(module: ModuleType | None) -> tuple[str, ...]:
    """Return the names of the services that a module needs: the arm's, and those in its `ALSO`."""
    return (*SERVICES, *getattr(module, "ALSO", ()))


@pytest.fixture(scope="module")
def shared_services(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Stack:
    """Return the running services of the module; their library has the shipped motion alone."""
    stack = SHARED.start(names_for(request.module), tmp_path_factory.mktemp("services"))
    revive(stack)
    for primitive in stack.bus.ask(topics.PRIMITIVES, m.Empty()).primitives:
        if primitive.name != SHIPPED:
            stack.bus.ask(topics.FORGET, m.Forget(name=primitive.name))
    return stack


@pytest.fixture
def stack(shared_services: Stack) -> Stack:
    """Return the module's services at the start of a new run; services that have ended are started again."""
    revive(shared_services)
    shared_services.reset()
    return shared_services


def revive(stack: Stack) -> None:
    """Start services that have ended."""
    if ended := stack.services.ended():
        stack.start_again(*ended)


@pytest.fixture(scope="module")
def survivors(shared_services: Stack) -> Iterator[None]:
    """Check after all tests of the module that the services play a goal."""
    yield
    shared_services.reset()
    assert shared_services.finish(shared_services.goal(duration=0.3)).outcome == "succeeded"


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
