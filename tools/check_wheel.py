"""Builds the wheel from the committed files and without Node, and looks into it.

``python -m tools.check_wheel``; the seconds that it prints are with everything that it downloads.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
import tempfile
import time
import zipfile
from pathlib import Path

ROOT = Path(__file__).parents[1]
STATIC = "odscen/web/static/"


def main() -> None:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        clone = folder / "clone"
        subprocess.run(["git", "clone", "--quiet", ROOT, clone], check=True)
        began = time.monotonic()
        subprocess.run(
            [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "-w", folder, clone],
            env={**os.environ, "PATH": f"{_no_node(folder)}{os.pathsep}{os.environ['PATH']}"},
            check=True,
        )
        seconds = time.monotonic() - began
        (wheel,) = folder.glob("*.whl")
        with zipfile.ZipFile(wheel) as opened:
            wrong = faults(opened)
            size = wheel.stat().st_size / 1e6
    if wrong:
        sys.exit("\n".join(wrong))
    print(f"the wheel ({size:.1f} MB, built in {seconds:.0f} s without Node) has its page and maps")


def _no_node(folder: Path) -> Path:
    """Folder for the head of PATH whose ``node`` and ``npm`` only fail."""
    shadow = folder / "shadow"
    shadow.mkdir()
    for program in ("node", "npm", "npx"):
        path = shadow / program
        path.write_text(
            "#!/bin/sh\necho 'the machine has its own Node; do not use it' >&2\nexit 1\n"
        )
        path.chmod(0o755)
    return shadow


def faults(wheel: zipfile.ZipFile) -> list[str]:
    """What the wheel lacks, or has too much."""
    names = set(wheel.namelist())
    if STATIC + "index.html" not in names:
        return ["the page is missing"]
    page = wheel.read(STATIC + "index.html").decode()
    parts = re.findall(r'(?:src|href)="\./([^"]+)"', page)
    missing = [part for part in parts if STATIC + part not in names]
    wrong = [f"the page asks for {part}, which is missing" for part in missing]
    if len(parts) < 2:
        wrong.append("the page asks for no script and no style")
    if len([name for name in names if name.endswith(".xodr")]) != len(
        list(ROOT.glob("maps/*.xodr"))
    ):
        wrong.append("shipped maps are missing")
    wrong += [f"{name} is missing" for name in sorted(_beside_the_code() - names)]
    wrong += [
        f"{name} does not belong here" for name in names if re.search(r"node_modules|\.tsx?$", name)
    ]
    return wrong


def _beside_the_code() -> set[str]:
    """Data, styles and templates that the modules read, by their name in the wheel."""
    sources = ROOT / "src"
    found = (path.relative_to(sources) for path in sources.rglob("*") if path.is_file())
    names = {path.as_posix() for path in found if path.suffix not in (".py", ".pyc")}
    return {name for name in names if not name.startswith(STATIC)}


if __name__ == "__main__":
    main()
