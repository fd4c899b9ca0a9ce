"""The OpenAPI schema against the server: no 5xx, and no answer that is not in the schema."""

from __future__ import annotations

import os
import shutil
from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

import pytest
import schemathesis
from hypothesis import HealthCheck, given, settings
from schemathesis.checks import not_a_server_error
from schemathesis.specs.openapi.checks import (
    content_type_conformance,
    response_schema_conformance,
    status_code_conformance,
)

from odscen.app.generation import generate
from odscen.app.scenarios import read_scenario
from odscen.app.signals.signal_plans import signal_programs
from odscen.maps.store import Workspace
from odscen.maps.wastebasket import Wastebasket
from odscen.scenario.sampling.generation_settings import GenerationSettings
from odscen.web.application import create_app
from tests.web.conftest import CROSSING, openapi_schema

CHECKS = [
    not_a_server_error,
    status_code_conformance,
    content_type_conformance,
    response_schema_conformance,
]
EXAMPLES = 30 if os.environ.get("ODSCEN_SLOW") == "all" else 8
"""Of each operation; the first of the same thirty where time is short."""
PATIENCE = 300.0
"""Seconds for an answer: what a busy machine takes says nothing of the schema."""
OPERATIONS = [
    (path, method)
    for path, methods in openapi_schema()["paths"].items()
    for method in methods
    if path != "/api/maps/shipped"  # would build seven maps, again and again
]


@asynccontextmanager
async def _kept(_app: object) -> AsyncIterator[None]:
    yield


@pytest.fixture(scope="module")
def kept(built: Path, tmp_path_factory: pytest.TempPathFactory) -> Workspace:
    root = tmp_path_factory.mktemp("schema") / "workspace"
    shutil.copytree(built, root)
    workspace = Workspace.open(root)
    for seed in (1, 2):
        generate(workspace, settings=GenerationSettings(map_name=CROSSING, seed=seed, fill=0.1))
    Wastebasket(workspace).put("scenario", f"{CROSSING}-0002")
    return workspace


@pytest.fixture(scope="module")
def light(kept: Workspace) -> str:
    scenario = read_scenario(kept.scenarios / f"{CROSSING}-0001.scenario.json")
    return signal_programs(kept, scenario)[0].junctions[0]


@pytest.fixture(scope="module")
def schema(kept: Workspace) -> Iterator[Any]:
    app = create_app(kept, hosts=None)
    app.router.lifespan_context = _kept  # schemathesis starts and ends the app for each request
    yield schemathesis.openapi.from_asgi("/api/openapi.json", app)
    app.state.services.close()


@pytest.mark.filterwarnings("default")  # of schemathesis itself
@pytest.mark.parametrize(("path", "method"), OPERATIONS)
def test_the_server_keeps_to_its_schema(
    schema: Any, kept: Workspace, light: str, path: str, method: str
) -> None:
    item = next((one.id for one in Wastebasket(kept).items()), "scenario-20260101-000000-00000000")
    known = {
        "name": f"{CROSSING}-0001",
        "run": "x-1",
        "sweep": "x-1",
        "study": "rain",
        "case": "case-001",
        "job": "job-1",
        "simulator": "carla-native",
        "template": "cut-in",
        "of": "openscenario",
        "junction": light,
        "item": item,
    }
    if path.startswith("/api/maps/"):
        known["name"] = CROSSING
    operation = schema[path][method]

    @settings(
        max_examples=EXAMPLES,
        deadline=None,
        derandomize=True,
        suppress_health_check=list(HealthCheck),
    )
    @given(case=operation.as_strategy())
    def check(case: schemathesis.Case) -> None:
        case.call_and_validate(checks=CHECKS, timeout=PATIENCE)
        if method != "delete":  # once more where there is something
            case.path_parameters = {k: known[k] for k in case.path_parameters or {}}
            case.call_and_validate(checks=CHECKS, timeout=PATIENCE)

    check()
