"""Generators and behaviour models that one can choose."""

from __future__ import annotations

from fastapi import APIRouter

from odscen.app.generators import installed_generators
from odscen.sumo.worker.behaviour.behaviour_doors import installed_behaviours
from odscen.web.messages import OfferedInfo

router = APIRouter(prefix="/api")


@router.get("/generators")
def list_generators() -> list[OfferedInfo]:
    """Generators that are installed, for the edit ``fill_roi``: the one that ships is the first."""
    return [OfferedInfo.of(one) for one in installed_generators()]


@router.get("/behaviours")
def list_behaviours() -> list[OfferedInfo]:
    """Behaviour models that are installed, for a new run: those that ship are the first."""
    return [OfferedInfo.of(one) for one in installed_behaviours()]
