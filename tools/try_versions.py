"""Tries odscen with the lowest versions that ``pyproject.toml`` admits, or with the newest ones.

``python -m tools.try_versions lowest`` makes an environment in ``build/versions`` in which what
odscen asks for itself has its lowest version, and what that asks for its newest; the demo is run
there, and a part of the tests. ``newest 3.12 3.13`` does the same with the newest versions, with
those Pythons that are on this machine, and says which are not. With both, a run of 3.13 is mirrored
in CARLA by the client of 3.12 beside it.
"""

from __future__ import annotations

import argparse
import os
import platform
import subprocess
import sys
import time
from pathlib import Path

ROOT = Path(__file__).parents[1]
BUILD = ROOT / "build" / "versions"
TESTS = (
    "tests/base",
    "tests/records",
    "tests/opendrive",
    "tests/experiments/test_journal.py",
    "tests/scenario/sweeps",
    "tests/web/test_security.py",
    "tests/cli/test_serve.py",
)
"""What touches each of the packages: tables, arrays, XML, the server, the command line."""
TOOLS = ("pytest", "psutil", "httpx2", "hypothesis")
UV = ROOT / ".venv" / "bin" / "uv"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("versions", choices=("lowest", "newest"))
    parser.add_argument("pythons", nargs="*", default=[platform.python_version()])
    given = parser.parse_args()
    failed = [each for each in given.pythons if not _try(given.versions, each)]
    if failed:
        sys.exit(f"{given.versions} versions fail with Python {', '.join(failed)}")


def _try(versions: str, wanted: str) -> bool:
    """Make the environment and run what is to be run there; true where that Python is missing."""
    found = _find_python(wanted)
    if found is None:
        print(f"Python {wanted} is not on this machine: not tried", flush=True)
        return True
    began = time.monotonic()
    folder = BUILD / f"{versions}-{wanted}"
    python = folder / "bin" / "python"
    _make_environment(versions, found, folder)
    environment = {**os.environ, "PATH": f"{python.parent}{os.pathsep}{os.environ['PATH']}"}
    commands = (
        (python, "-m", "odscen", "demo", "--workspace", folder / "demo"),
        # Old versions warn of new Pythons; pytest writes nothing into the sources.
        (python, "-m", "pytest", "-q", "-o", "filterwarnings=default", "-p", "no:cacheprovider",
         "-m", "not slow", *TESTS),
    )  # fmt: skip
    good = all(
        subprocess.run(command, cwd=ROOT, env=environment, check=False).returncode == 0
        for command in commands
    )
    seconds = time.monotonic() - began
    print(f"{versions} versions, Python {wanted}: {'good' if good else 'BAD'}, {seconds:.0f} s")
    return good


def _find_python(wanted: str) -> str | None:
    """Path of a Python of this machine: one that uv finds, or of pyenv.

    Of pyenv's versions that are not switched on, the path has a stand-in that only fails.
    """
    found = subprocess.run(
        [UV, "python", "find", "--no-python-downloads", wanted],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    if found.returncode == 0:
        return found.stdout.strip()
    versions = Path(os.environ.get("PYENV_ROOT", Path.home() / ".pyenv")) / "versions"
    own = sorted(versions.glob(f"{wanted}*/bin/python"))
    return str(own[-1]) if own else None


def _make_environment(versions: str, python: str, folder: Path) -> None:
    pinned = folder.with_suffix(".txt")
    resolution = "lowest-direct" if versions == "lowest" else "highest"
    project = ROOT / "pyproject.toml"
    folder.parent.mkdir(parents=True, exist_ok=True)
    own = folder / "bin" / "python"
    for command in (
        ("venv", "--quiet", "--clear", "--python", python, folder),
        ("pip", "compile", "--quiet", "--no-header", "--resolution", resolution,
         "--python", own, "--extra", "png", "--extra", "carla", "--output-file", pinned, project),
        ("pip", "install", "--quiet", "--python", own, "--requirements", pinned),
        ("pip", "install", "--quiet", "--python", own, "--no-deps", "--editable", ROOT),
        ("pip", "install", "--quiet", "--python", own, "--constraints", pinned, *TOOLS),
    ):  # fmt: skip
        subprocess.run([UV, *map(str, command)], check=True, cwd=ROOT, stdout=subprocess.DEVNULL)


if __name__ == "__main__":
    main()
