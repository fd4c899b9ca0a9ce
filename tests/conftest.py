from __future__ import annotations

import os
import zlib
from pathlib import Path

import pytest
from hypothesis import settings

# A busy machine is no failure: timings are for benchmarks.
settings.register_profile("odscen", deadline=None)
settings.load_profile("odscen")

# Of the slow tests `make test` runs one in so many, the same at each commit; `make test SLOW=all`
# runs all of them, see CONTRIBUTING.md.
SLOW_PARTS = 64

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
    skip = pytest.mark.skip(reason="slow, and not of the part for each commit; ODSCEN_SLOW=all")
    for item in items:
        slow = item.get_closest_marker("slow")
        if slow is not None and (asked == "none" or not _is_sampled(item, slow)):
            item.add_marker(skip)


def _is_sampled(item: pytest.Item, slow: pytest.Mark) -> bool:
    """Whether a slow test is of the part for each commit; those that share what is slow are both.

    By its name alone: the same tests at each commit, and a new one changes nothing for the others.
    """
    name = item.nodeid.partition("::")[0] if slow.kwargs.get("together") else item.nodeid
    return zlib.crc32(name.encode()) % SLOW_PARTS == 0
