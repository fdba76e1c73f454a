"""The services of a system test.

`stack` is shared by the tests of a module. Before each test it starts a new run with the arm at home, and restarts the
processes that an earlier test ended. A test that needs other processes or another clock starts its own with
`harness.running`.
"""

from collections.abc import Iterator

import pytest
from harness import SERVICES, Stack, running


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
