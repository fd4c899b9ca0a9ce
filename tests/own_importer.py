"""The package of the recipe in CONTRIBUTING.md with a map importer of its own, as if installed."""

from __future__ import annotations

import os
import re
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from odscen.maps.child_process import end_waiting

if TYPE_CHECKING:
    import pytest

CONTRIBUTING = Path(__file__).parents[1] / "CONTRIBUTING.md"
PLACE = b"""lanes 2
speed 30
0 0
40 0
80 5
120 10
160 10
200 5
240 0
300 0
"""


def install(folder: Path, patch: pytest.MonkeyPatch, code: str | None = None) -> None:
    """Put the package on the path of this process and of those that it starts."""
    section = CONTRIBUTING.read_text(encoding="utf-8").partition("## Recipe: a map importer")[2]
    entries = re.findall(r"^```toml\n(.*?)^```$", section, re.MULTILINE | re.DOTALL)[0]
    (folder / "my_maps.py").write_text(shown_code() if code is None else code)
    about = folder / "my_maps-1.0.dist-info"
    about.mkdir(exist_ok=True)
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: my-maps\nVersion: 1.0\n")
    groups = re.sub(r'project\.entry-points\."(.*)"', r"\1", entries).replace('"', "")
    (about / "entry_points.txt").write_text(groups)
    patch.syspath_prepend(folder)
    path = os.pathsep.join(filter(None, [str(folder), os.environ.get("PYTHONPATH")]))
    patch.setenv("PYTHONPATH", path)
    forget()


def shown_code() -> str:
    """The importer as the recipe shows it."""
    section = CONTRIBUTING.read_text(encoding="utf-8").partition("## Recipe: a map importer")[2]
    shown: str = re.findall(r"^```python\n(.*?)^```$", section, re.MULTILINE | re.DOTALL)[0]
    return shown


def forget() -> None:
    """Let the package be looked for again, here and in a child that waits for work."""
    sys.modules.pop("my_maps", None)
    end_waiting()
