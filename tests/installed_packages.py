"""Packages that documents show, on the path with their entry points, as if installed by pip."""

from __future__ import annotations

import importlib
import os
import re
import sys
import tomllib
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import pytest

DOCS = Path(__file__).parents[1] / "docs"


def install_shown(
    document: str, heading: str, folder: Path, patch: pytest.MonkeyPatch, *, number: int = 0
) -> None:
    """Install the package of a section: its module and what its pyproject.toml says of it.

    ``number`` counts the packages of the section.
    """
    section = (DOCS / document).read_text(encoding="utf-8").partition(heading)[2]
    about, code = (
        re.findall(rf"^```{kind}\n(.*?)^```$", section, re.MULTILINE | re.DOTALL)[number]
        for kind in ("toml", "python")
    )
    project = tomllib.loads(about)
    install(folder, patch, code=code, entry_points=project["project"]["entry-points"])


def install(
    folder: Path,
    patch: pytest.MonkeyPatch,
    *,
    code: str,
    entry_points: dict[str, dict[str, str]],
) -> None:
    """Put a module and its entry points on the path of this process and of those it starts."""
    first = next(iter(entry_points.values()))
    module = next(iter(first.values())).partition(":")[0]
    info = folder / f"{module}-1.0.dist-info"
    info.mkdir(parents=True)
    (folder / f"{module}.py").write_text(code, encoding="utf-8")
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {module}\nVersion: 1.0\n")
    lines = []
    for name, entries in entry_points.items():
        lines += [f"[{name}]", *(f"{entry} = {value}" for entry, value in entries.items())]
    (info / "entry_points.txt").write_text("\n".join(lines) + "\n")
    patch.delitem(sys.modules, module, raising=False)
    patch.syspath_prepend(folder)
    path = os.pathsep.join(filter(None, [str(folder), os.environ.get("PYTHONPATH")]))
    patch.setenv("PYTHONPATH", path)
    importlib.invalidate_caches()
