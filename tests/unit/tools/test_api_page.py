"""docs/api.md is current, and documents the exports of packages."""

import re
from pathlib import Path

import motion
from tools.pages import api

PAGE = api.ROOT / "docs" / "api.md"


ARM = '''"""The arm."""

from client.base import Requests

class Arm(Requests[int]):
    """An arm.

    Args:
        name: its name,
            in full
    """

    def __init__(self, name: str, *, patience_s: float = 1.0) -> None: ...

    async def goal(self) -> int:
        """Play."""

    def _hidden(self): ...

def twice(): ...
'''


BASE = '''"""What arms have in common."""

class Requests(Generic[T]):
    """Requests."""

    @SyncOrAsync
    async def cancel(self) -> None:
        """Stop."""
'''


def test_page_is_up_to_date():
    assert PAGE.read_text(encoding="utf-8") == api.page(), "run: python -m tools.pages.api > docs/api.md"


def test_every_module_in_motions_docstring_is_documented():
    named = set(re.findall(r"`(\w+)`", motion.__doc__ or ""))
    assert named == set(api.public("motion")), "motion's docstring names a module that does not exist"
    text = api.page()
    assert all(f"### motion.{module}\n" in text for module in named)


def test_signatures_are_those_of_the_source():
    text = api.page()
    assert "def sample(times: np.ndarray) -> Samples\n" in text
    assert "def unlimited(joint_count: int) -> 'Limits'\n" in text
    assert "duration: float\n```\n\nTime of the last break, s." in text


def test_of_a_package_with_all_only_the_exports_are_documented(tmp_path: Path, monkeypatch):
    package = tmp_path / "client"
    package.mkdir()
    (package / "__init__.py").write_text('"""A client."""\nfrom client.arm import Arm, twice\n__all__ = ["Arm"]\n')
    (package / "arm.py").write_text(ARM)
    (package / "base.py").write_text(BASE)
    monkeypatch.setattr(api, "ROOT", tmp_path)
    text = api.page()
    assert "class Arm(name: str, *, patience_s: float = 1.0)\n" in text
    assert "async def goal() -> int\n" in text
    assert "Args\n\n- name: its name, in full\n" in text
    assert "```python\ndef cancel() -> None\n```\n\nStop.\n" in text, "inherited, and without async"
    assert "_hidden" not in text and "twice" not in text and "client.base" not in text
