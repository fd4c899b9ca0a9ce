"""How close road users came to a crash; measured in :mod:`odscen.figures.measures.conflicts`.

Where no conflict was recorded a figure is at the limit of what is recorded.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from odscen.figures.measures.conflicts import SEEN_DRAC, SEEN_PET, SEEN_TTC, is_serious
from odscen.figures.measures.figure import (
    COUNT,
    Basis,
    Better,
    Display,
    ReportSection,
    RunFigure,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from typing import Any

    import polars as pl

    from odscen.figures.measures.figure import RunData

_FHWA = "FHWA-RD-03-050"
_SSM = f"{_FHWA}; SUMO's SSM device"
_SECONDS = Display("s", digits=2)


def _list_measured_values(run: RunData, measure: str, *, walking: bool) -> list[float]:
    """Values of a measure in conflicts between vehicles, or of pedestrians with them."""
    if run.conflicts is None:
        return []
    afoot: pl.Series = run.conflicts["kind"] == "walking"
    chosen = run.conflicts.filter(afoot if walking else ~afoot)
    values: list[float] = chosen[measure].drop_nulls().to_list()
    return values


def _least_value(
    measure: str, limit: float, *, walking: bool = False
) -> Callable[[RunData], float]:
    return lambda run: min([limit, *_list_measured_values(run, measure, walking=walking)])


def _count_serious(run: RunData) -> float | None:
    if run.conflicts is None:
        return None
    return float(run.conflicts.select(is_serious().sum()).item())


def _describe_total(values: Mapping[str, Any]) -> str:
    recorded = values.get("conflicts")
    return "" if recorded is None else f"of {recorded:,} recorded"


FIGURES = (
    RunFigure(
        name="min_ttc",
        unit="s",
        label="shortest time to collision (TTC)",
        definition="Shortest time to collision (TTC) between vehicles.",
        source=_SSM,
        better=Better.HIGHER,
        basis=Basis.CONFLICTS,
        display=_SECONDS,
        section=ReportSection.CONFLICTS,
        note="of vehicles",
        limit=SEEN_TTC,
        compute=_least_value("ttc", SEEN_TTC),
    ),
    RunFigure(
        name="max_drac",
        unit="m/s2",
        label="highest deceleration to avoid a crash",
        definition="Highest deceleration rate to avoid a crash (DRAC) between vehicles.",
        source=_SSM,
        better=Better.LOWER,
        basis=Basis.CONFLICTS,
        display=Display("m/s\u00b2"),
        section=ReportSection.CONFLICTS,
        note="DRAC, of vehicles",
        limit=SEEN_DRAC,
        compute=lambda run: max([SEEN_DRAC, *_list_measured_values(run, "drac", walking=False)]),
    ),
    RunFigure(
        name="min_pet",
        unit="s",
        label="shortest post-encroachment time (PET)",
        definition="Shortest post-encroachment time (PET) between vehicles.",
        source=_SSM,
        better=Better.HIGHER,
        basis=Basis.CONFLICTS,
        display=_SECONDS,
        section=ReportSection.CONFLICTS,
        note="of vehicles at one spot",
        limit=SEEN_PET,
        compute=_least_value("pet", SEEN_PET),
    ),
    RunFigure(
        name="pedestrian_min_pet",
        unit="s",
        label="shortest PET with a pedestrian",
        definition="Shortest post-encroachment time (PET) between a pedestrian and a vehicle.",
        source=f"{_FHWA}; odscen, from the trajectories",
        better=Better.HIGHER,
        basis=Basis.CONFLICTS,
        display=_SECONDS,
        section=ReportSection.CONFLICTS,
        note="at one spot",
        limit=SEEN_PET,
        compute=_least_value("pet", SEEN_PET, walking=True),
    ),
    RunFigure(
        name="serious_conflicts",
        unit="",
        label="serious conflicts",
        definition="Conflicts with a TTC of 1.5 s or less, a PET of 1 s or less, or a DRAC of "
        "3.35 m/s\u00b2 or more.",
        source=_FHWA,
        better=Better.LOWER,
        basis=Basis.CONFLICTS,
        display=COUNT,
        section=ReportSection.CONFLICTS,
        note=_describe_total,
        alarming=True,
        compute=_count_serious,
    ),
)
