from __future__ import annotations

import os
from pathlib import Path

import pytest
from hypothesis import settings

# A busy machine is no failure: timings are for benchmarks.
settings.register_profile("odscen", deadline=None)
settings.load_profile("odscen")

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
