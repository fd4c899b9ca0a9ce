from __future__ import annotations

import os
import subprocess
import zlib
from pathlib import Path

import pytest
from hypothesis import settings

# A busy machine is no failure: timings are for benchmarks.
settings.register_profile("odscen", deadline=None)
settings.load_profile("odscen")

# Of the slow tests each commit runs one in so many, the next one others; see CONTRIBUTING.md.
SLOW_PARTS = 16

_DEFAULT_MAPS = Path(__file__).parents[2] / "shared" / "maps"


def shared_map_files() -> tuple[Path, ...]:
    """Sort all real maps at hand; none when the folder is missing."""
    folder = Path(os.environ.get("ODSCEN_TEST_MAPS", _DEFAULT_MAPS))
    return tuple(sorted(folder.glob("*/*.xodr"))) if folder.is_dir() else ()


@pytest.fixture(scope="session")
def shared_maps() -> Path:
    folder = Path(os.environ.get("ODSCEN_TEST_MAPS", _DEFAULT_MAPS))
    if not folder.is_dir():
        pytest.skip("real maps are not here; name their folder in ODSCEN_TEST_MAPS")
    return folder


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Leave out the slow tests whose turn it is not; what is named runs whole."""
    asked = os.environ.get("ODSCEN_SLOW", "none")
    if asked not in {"none", "part", "all"}:
        raise pytest.UsageError(f"ODSCEN_SLOW is {asked!r}: none, part or all")
    if asked == "all" or any(".py" in argument for argument in config.args):
        return
    commit = _commit(config.rootpath)
    skip = pytest.mark.skip(reason="slow: another commit's turn; ODSCEN_SLOW=all runs all")
    for item in items:
        slow = item.get_closest_marker("slow")
        if slow is not None and (asked == "none" or _turn(item, slow, commit)):
            item.add_marker(skip)


def _turn(item: pytest.Item, slow: pytest.Mark, commit: str) -> int:
    """Draw by commit and name; it is its turn at 0. Tests that share what is slow run together."""
    name = item.nodeid.partition("::")[0] if slow.kwargs.get("together") else item.nodeid
    return zlib.crc32(f"{commit} {name}".encode()) % SLOW_PARTS


def _commit(root: Path) -> str:
    """Name what is checked out; sources without a history are one commit."""
    git = ["git", "-C", str(root), "rev-parse", "HEAD"]
    try:
        return subprocess.run(git, capture_output=True, text=True, check=True).stdout.strip()
    except (OSError, subprocess.CalledProcessError):
        return ""
