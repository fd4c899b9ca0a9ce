"""The behaviour model of a run: what it drives, and the lights that it switches."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from odscen.runs.layout import BEHAVIOUR_FILE, SUMO_FOLDER
from odscen.sumo.worker.behaviour.behaviour_doors import (
    open_behaviour,
    read_behaviour,
    switches_lights,
)
from odscen.sumo.worker.behaviour.behaviour_run import BehaviourRun
from odscen.sumo.worker.behaviour.light_run import LightRun

if TYPE_CHECKING:
    from pathlib import Path

    from odscen.records.run_plan import Plan


def open_model(run: Path, plan: Plan) -> tuple[BehaviourRun | None, LightRun | None]:
    """The model of the run in a folder, as one that drives, one that switches lights, or both.

    Raises
    ------
    InputError
        If it cannot be made.
    """
    door = read_behaviour((run / SUMO_FOLDER / BEHAVIOUR_FILE).read_text(encoding="utf-8"))
    model: Any = open_behaviour(door, plan.seed)
    lights = LightRun.in_folder(run, model, plan, door.shown) if switches_lights(model) else None
    drives = callable(getattr(model, "act", None))
    return BehaviourRun(model, plan, door.shown) if drives else None, lights
