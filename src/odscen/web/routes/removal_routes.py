"""Routes for removing maps, scenarios and runs, and for the wastebasket."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING

from fastapi import APIRouter

from odscen.app.removal import removal_facts, remove
from odscen.maps.wastebasket import RemovedKind, Wastebasket
from odscen.web.messages import Answer
from odscen.web.services import Services, Shared

if TYPE_CHECKING:
    from odscen.maps.wastebasket import RemovedItem

router = APIRouter(prefix="/api")


class RemovalInfo(Answer):
    """What stays behind, and needs what is to be removed."""

    kind: RemovedKind
    name: str
    scenarios: int
    runs: int
    live: int


class RemovedInfo(Answer):
    """Something in the wastebasket; ``removed`` and ``until`` are seconds since 1970."""

    id: str
    kind: RemovedKind
    name: str
    removed: float
    until: float


class RemovedRow(RemovedInfo):
    """The same with its size on the disk, bytes."""

    size: int


@router.get("/maps/{name}/removal")
def map_removal(name: str, shared: Shared) -> RemovalInfo:
    """What depends on a map."""
    return _facts_of_removal(shared, "map", name)


@router.get("/scenarios/{name}/removal")
def scenario_removal(name: str, shared: Shared) -> RemovalInfo:
    """What depends on a scenario."""
    return _facts_of_removal(shared, "scenario", name)


@router.get("/runs/{run}/removal")
def run_removal(run: str, shared: Shared) -> RemovalInfo:
    """Whether a run can be removed."""
    return _facts_of_removal(shared, "run", run)


@router.delete("/maps/{name}")
def remove_map(name: str, shared: Shared) -> RemovedInfo:
    """Move a map into the wastebasket; scenarios made on it stay."""
    return _info_of_item(remove(shared.workspace, "map", name))


@router.delete("/scenarios/{name}")
def remove_scenario(name: str, shared: Shared) -> RemovedInfo:
    """Move a scenario and its history into the wastebasket; its runs stay."""
    return _info_of_item(shared.drafts.remove(name))


@router.delete("/runs/{run}")
def remove_run(run: str, shared: Shared) -> RemovedInfo | None:
    """Move a finished run into the wastebasket; null if it has left nothing to keep."""
    item = shared.runs.remove(run)
    return None if item is None else _info_of_item(item)


@router.get("/trash")
def list_trash(shared: Shared) -> list[RemovedRow]:
    """Everything in the wastebasket, removed last first."""
    items = Wastebasket(shared.workspace).items()
    return [RemovedRow(**dict(_info_of_item(item)), size=item.size()) for item in items]


@router.post("/trash/{item}/restore")
def restore(item: str, shared: Shared) -> RemovedInfo:
    """Put an item back where it was; 409 if something of that name is there now."""
    return _info_of_item(shared.drafts.restore(item))


@router.delete("/trash/{item}")
def delete_item(item: str, shared: Shared) -> RemovedInfo:
    """Delete an item for good."""
    return _info_of_item(Wastebasket(shared.workspace).delete(item))


def _facts_of_removal(shared: Services, kind: RemovedKind, name: str) -> RemovalInfo:
    found = removal_facts(shared.workspace, kind, name, runs=shared.runs.known())
    return RemovalInfo(**asdict(found))


def _info_of_item(item: RemovedItem) -> RemovedInfo:
    return RemovedInfo(
        id=item.id,
        kind=item.kind,
        name=item.name,
        removed=item.removed.timestamp(),
        until=item.until.timestamp(),
    )
