"""The package of docs/api.md with a condition and an action of its own, as if installed."""

from __future__ import annotations

import os
import re
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from odscen.scenario.story import own_kinds

if TYPE_CHECKING:
    import pytest

API = Path(__file__).parents[1] / "docs" / "api.md"


def install(folder: Path, patch: pytest.MonkeyPatch, code: str | None = None) -> None:
    """Put the package on the path of this process and of those that it starts."""
    section = API.read_text(encoding="utf-8").partition("## Own conditions and actions")[2]
    entries = re.findall(r"^```toml\n(.*?)^```$", section, re.MULTILINE | re.DOTALL)[0]
    shown = re.findall(r"^```python\n(.*?)^```$", section, re.MULTILINE | re.DOTALL)[0]
    (folder / "my_kinds.py").write_text(shown if code is None else code)
    about = folder / "my_kinds-1.0.dist-info"
    about.mkdir()
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: my-kinds\nVersion: 1.0\n")
    groups = re.sub(r'project\.entry-points\."(.*)"', r"\1", entries).replace('"', "")
    (about / "entry_points.txt").write_text(groups)
    patch.syspath_prepend(folder)
    path = os.pathsep.join(filter(None, [str(folder), os.environ.get("PYTHONPATH")]))
    patch.setenv("PYTHONPATH", path)
    forget()


def forget() -> None:
    """Let the package be looked for again."""
    sys.modules.pop("my_kinds", None)
    own_kinds.own_condition.cache_clear()
    own_kinds.own_action.cache_clear()
