"""What breaks of a public API: found in its public names alone."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

from tools.api_changes import breaking_changes

if TYPE_CHECKING:
    from pathlib import Path

griffe = pytest.importorskip("griffe")

PUBLIC = """
from typing import TYPE_CHECKING
if TYPE_CHECKING:
    from pkg.inner import run as run, Settings as Settings
__all__ = ["run", "Settings"]
"""
BEFORE = """
def run(scenario, *, seed=1): ...
class Settings:
    def write(self, path): ...
def not_public(a): ...
"""


def package(folder: Path, public: str, inner: str) -> Any:
    (folder / "pkg").mkdir(parents=True)
    (folder / "pkg" / "__init__.py").write_text(public)
    (folder / "pkg" / "inner.py").write_text(inner)
    return griffe.load("pkg", search_paths=[str(folder)])


@pytest.mark.parametrize(
    ("public", "inner", "said"),
    [
        (PUBLIC, BEFORE.replace("(a)", "()"), []),
        (PUBLIC, BEFORE.replace("seed=1", "seed=1, until=None"), []),
        (
            PUBLIC,
            BEFORE.replace("(scenario,", "(scenario, until,"),
            ["pkg.inner.run: run(until): Parameter was added as required"],
        ),
        (
            PUBLIC,
            BEFORE.replace("def write(self, path): ...", "pass"),
            ["pkg.inner.Settings.write: Settings.write: Public object was removed"],
        ),
        (PUBLIC.replace(', "Settings"', "").replace(", Settings as Settings", ""), BEFORE,
         ["pkg.Settings: it is gone"]),
    ],
)  # fmt: skip
def test_what_users_call_may_not_go(
    tmp_path: Path, public: str, inner: str, said: list[str]
) -> None:
    old = package(tmp_path / "old", PUBLIC, BEFORE)
    new = package(tmp_path / "new", public, inner)
    assert list(breaking_changes(old, new, ["pkg"])) == said
