"""One case of a sweep as a scenario by itself."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Final

from odscen.app.scenarios import SUFFIX, read_scenario
from odscen.base.errors import NotFoundError
from odscen.experiments.cases.sweep_rows import limit_from_text
from odscen.experiments.sweeps.sweep_folder import read_sweep

if TYPE_CHECKING:
    from pathlib import Path

    from odscen.experiments.cases.sweep_rows import Limit
    from odscen.scenario.document.scenario_document import Scenario

_CASE: Final = re.compile(r"case-\d{3,9}")
_TTC: Final = "min_ttc"
_RECORDED: Final = 3.0
"""Seconds to which times to collision are recorded: a criterion above them has no meaning."""


def opened_case(out: Path, case: str) -> Scenario:
    """One case as a scenario of numbers that runs alone as it did in the sweep.

    It has the seed of the sweep's runs. What the sweep calls safe of an ego become its criteria, so
    that its result says the same: ``collided(ego) == 0`` and limits of time to collision.

    Parameters
    ----------
    out
        Folder of the sweep.
    case
        Name of the case, ``case-012``.

    Raises
    ------
    NotFoundError
        If there is no such case, or it is not possible.
    InputError
        If there is no sweep.
    """
    file = out / "cases" / f"{case}{SUFFIX}"
    if not _CASE.fullmatch(case) or not file.is_file():
        raise NotFoundError(f"case of sweep {out.name!r}", case, [])
    whole, _, said = read_sweep(out)
    found = read_scenario(file)
    limits = [limit for text in said["safe"] if (limit := _of_ttc(text)) is not None]
    criteria = list(found.criteria)
    if any(actor.ego for actor in found.actors):
        own = ["collided(ego) == 0", *(_criterion(limit) for limit in limits)]
        criteria += [text for text in own if text not in criteria]
    changes = {
        "name": f"{whole.name[:100]}, {case}",
        "seed": found.seed if said["seed"] is None else said["seed"],
        "criteria": tuple(criteria),
    }
    return found.model_copy(update=changes)


def _criterion(limit: Limit) -> str:
    return f"{limit.column}(ego) {limit.op} {limit.bound:g} s"


def _of_ttc(text: str) -> Limit | None:
    """A limit if it is one of time to collision that a criterion can hold as well."""
    if re.match(rf"\s*{_TTC}\s*>", text) is None:
        return None
    limit = limit_from_text(text, [_TTC])
    return limit if limit.bound <= _RECORDED else None
