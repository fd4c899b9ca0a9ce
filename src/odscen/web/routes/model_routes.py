"""Generators, behaviour models and simulators that one can choose."""

from __future__ import annotations

from dataclasses import asdict

from fastapi import APIRouter

from odscen.app.generators import installed_generators
from odscen.app.maps import map_of
from odscen.app.running.runs import run_map, unsupported_parts
from odscen.simulators.installed import (
    CARLA_MIRROR,
    CARLA_NATIVE,
    ESMINI,
    METADRIVE,
    installed_simulators,
    open_simulator,
)
from odscen.sumo.worker.behaviour.behaviour_doors import installed_behaviours
from odscen.web.messages import Name, OfferedInfo, ProblemInfo
from odscen.web.services import Shared

router = APIRouter(prefix="/api")
_SERVER_OPTIONS = frozenset({"address", "program", "python"})
"""Options that whoever starts the server decides."""


@router.get("/generators")
def list_generators() -> list[OfferedInfo]:
    """Generators that are installed, for the edit ``fill_roi``: the one that ships is the first."""
    return [OfferedInfo.of(installed_generator) for installed_generator in installed_generators()]


@router.get("/behaviours")
def list_behaviours() -> list[OfferedInfo]:
    """Behaviour models that are installed, for a new run: those that ship are the first."""
    return [OfferedInfo.of(installed_behaviour) for installed_behaviour in installed_behaviours()]


@router.get("/simulators")
def list_simulators() -> list[OfferedInfo]:
    """Simulators that are installed, for a new run: those that ship are the first.

    The address of a CARLA server is the one that this server was started with, and what programs it
    starts is its business: a simulator that ships has no such options here.
    """
    rows = []
    for offered in installed_simulators():
        kept = tuple(option for option in offered.options if option.name not in _SERVER_OPTIONS)
        shipped = offered.name in (CARLA_MIRROR, CARLA_NATIVE, METADRIVE, ESMINI)
        rows.append(OfferedInfo.of(offered._replace(options=kept) if shipped else offered))
    return rows


@router.get("/simulators/{simulator}/unsupported")
def list_unsupported(simulator: str, scenario: Name, shared: Shared) -> list[ProblemInfo]:
    """What a simulator does not do of a scenario as it is now."""
    chosen = open_simulator(simulator, installed_only=True)
    document = shared.drafts.get(scenario).scenario
    entry = map_of(shared.workspace, document).entry
    problems = unsupported_parts(chosen, document, run_map(entry, shared.workspace.assets()))
    return [ProblemInfo(**asdict(problem)) for problem in problems]
