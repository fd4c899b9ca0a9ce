"""The package of CONTRIBUTING.md with a format of its own, as if installed."""

from __future__ import annotations

import os
import re
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import odscen.formats

if TYPE_CHECKING:
    import pytest

RECIPE = Path(__file__).parents[1] / "CONTRIBUTING.md"


def install(folder: Path, patch: pytest.MonkeyPatch) -> None:
    """Put the package on the path of this process and of those that it starts."""
    section = RECIPE.read_text(encoding="utf-8").partition("## Recipe: a format")[2]
    entries = re.findall(r"^```toml\n(.*?)^```$", section, re.MULTILINE | re.DOTALL)[0]
    code = re.findall(r"^```python\n(.*?)^```$", section, re.MULTILINE | re.DOTALL)[0]
    (folder / "my_format.py").write_text(code)
    about = folder / "my_format-1.0.dist-info"
    about.mkdir()
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: my-format\nVersion: 1.0\n")
    groups = re.sub(r'project\.entry-points\."(.*)"', r"\1", entries).replace('"', "")
    (about / "entry_points.txt").write_text(groups)
    patch.syspath_prepend(folder)
    path = os.pathsep.join(filter(None, [str(folder), os.environ.get("PYTHONPATH")]))
    patch.setenv("PYTHONPATH", path)
    forget()


def forget() -> None:
    """Let the package be looked for again."""
    sys.modules.pop("my_format", None)
    odscen.formats.list_formats.cache_clear()
