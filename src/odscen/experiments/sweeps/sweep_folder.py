"""What the folder of a sweep says of itself: which scenario is swept, how, and how it is judged.

It holds ``sweep.json`` (what is swept), ``scenario.json`` (the scenario with its formulas),
``cases/`` (each case as a scenario of numbers only), ``runs/`` (a run folder for each),
``cases.parquet`` (a row for each) and ``sweep.html``.
"""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING, Any, Final

from odscen.base.errors import ConflictError, InputError, in_file
from odscen.base.stored_files import read_document
from odscen.base.text_files import write_text
from odscen.learning.behaviour.behaviour_model import BehaviourDoor
from odscen.scenario.document.json_form import dumps, loads
from odscen.scenario.sweeps.sweep_plan import plan_from_data

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence
    from pathlib import Path

    from odscen.runs.finished_run import Run
    from odscen.scenario.document.scenario_document import Scenario
    from odscen.scenario.sweeps.sweep_plan import SweepPlan

FORMAT: Final = "odscen-sweep"
VERSION: Final = 1
SWEEP_FILE, SCENARIO_FILE = "sweep.json", "scenario.json"


@dataclass(frozen=True, slots=True)
class SweepSettings:
    """How a sweep is run and judged.

    Attributes
    ----------
    safe
        Limits that a case needs to keep to be safe, besides no collision: ``min_ttc >= 1.5``.
    figures
        Figures of runs that are columns as well.
    own
        Columns of one's own: functions of a finished run.
    seed
        Of every run; the scenario's if not given.
    reports
        Whether each run has a report.
    openscenario
        Version of OpenSCENARIO in which each case is written as well, ``1.0`` to ``1.3``.
    behaviour
        What drives vehicles instead of SUMO.
    """

    safe: Sequence[str] = ()
    figures: Sequence[str] = ()
    own: Mapping[str, Callable[[Run], float | None]] = field(default_factory=dict)
    seed: int | None = None
    reports: bool = False
    openscenario: str | None = None
    behaviour: BehaviourDoor | None = None

    def to_dict(self) -> dict[str, Any]:
        """JSON-ready; columns of one's own by name."""
        said = {
            "safe": list(self.safe),
            "figures": [*self.figures, *self.own],
            "seed": self.seed,
        }
        return said if self.behaviour is None else said | {"behaviour": asdict(self.behaviour)}


def settings_from_dict(data: Mapping[str, Any]) -> SweepSettings:
    """Read what :meth:`SweepSettings.to_dict` writes, of a sweep without columns of one's own."""
    given = data.get("behaviour")
    return SweepSettings(
        tuple(data["safe"]),
        tuple(data["figures"]),
        seed=data["seed"],
        behaviour=None if given is None else BehaviourDoor(**given),
    )


def read_plan(out: Path) -> tuple[SweepPlan, dict[str, Any]]:
    """Read what a folder varies, and how it is judged.

    Raises
    ------
    InputError
        If there is no sweep.
    """
    file = out / SWEEP_FILE
    if not file.is_file():
        raise InputError("no sweep is here: it has no sweep.json", file=str(out))
    with in_file(str(file)):
        data = read_document(file.read_bytes(), form=FORMAT, version=VERSION, what="a sweep")
        plan, settings = data.get("plan"), data.get("settings")
        if not isinstance(plan, dict) or not isinstance(settings, dict):
            raise InputError("a sweep has a plan and settings, and this has none")
        return plan_from_data(plan), settings


def read_sweep(out: Path) -> tuple[Scenario, SweepPlan, dict[str, Any]]:
    """Read what a folder sweeps, and how it is judged.

    Raises
    ------
    InputError
        If there is no sweep.
    """
    plan, settings = read_plan(out)
    text = (out / SCENARIO_FILE).read_bytes()
    return loads(text, file=str(out / SCENARIO_FILE)), plan, settings


def begin_sweep(out: Path, scenario: Scenario, plan: SweepPlan, settings: SweepSettings) -> None:
    """Write what is swept.

    Raises
    ------
    ConflictError
        If the folder holds another sweep.
    """
    head = {"format": FORMAT, "version": VERSION}
    said = head | {"plan": plan.to_dict(), "settings": settings.to_dict()}
    begin_folder(out, {SWEEP_FILE: said}, scenario, what="sweep")


def begin_folder(
    out: Path, said: Mapping[str, Mapping[str, Any]], scenario: Scenario, *, what: str
) -> None:
    """Write what the folder of a sweep or a search is about, by file, and its scenario.

    Raises
    ------
    ConflictError
        If the folder holds another one.
    """
    files = {
        name: json.dumps(data, indent=2, ensure_ascii=False) + "\n" for name, data in said.items()
    }
    files[SCENARIO_FILE] = dumps(scenario)
    there = {name: out / name for name in files if (out / name).is_file()}
    for name, file in there.items():
        if file.read_text(encoding="utf-8") != files[name]:
            raise ConflictError(f"{out} holds another {what} ({name} differs); name another folder")
    for name in files.keys() - there.keys():
        write_text(out / name, files[name])
