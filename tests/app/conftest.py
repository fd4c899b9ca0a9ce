from pathlib import Path

import pytest

from odscen.app.generation import generate
from odscen.maps.store import Workspace
from odscen.scenario.sampling.generation_settings import GenerationSettings

MAPS = Path(__file__).parents[2] / "maps"
CROSSING = "signal_crossing"


@pytest.fixture(scope="session")
def workspace(tmp_path_factory: pytest.TempPathFactory) -> Workspace:
    store = Workspace.open(tmp_path_factory.mktemp("app"))
    store.add_map(MAPS / f"{CROSSING}.xodr")
    return store


@pytest.fixture(scope="session")
def sampled(workspace: Workspace) -> Path:
    """File of a scenario with some road users."""
    settings = GenerationSettings(map_name=CROSSING, seed=5, fill=0.2)
    return generate(workspace, settings=settings)[0]
