"""Where a scenario has changed: the map with the figures of the baseline, and with those of now."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from odscen.app.maps import load_map
from odscen.base.markup import Markup, element
from odscen.experiments.regression.place_map import place_map
from odscen.experiments.regression.verdict import FEWEST
from odscen.experiments.suites.suite_loading import map_before
from odscen.reports.charts import legend
from odscen.reports.report_maps import SPEED_STEPS_KMH, place_shapes

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from odscen.experiments.regression.case_results import CaseResult
    from odscen.experiments.regression.measure import FigureKey
    from odscen.experiments.regression.place_map import PlaceStyles
    from odscen.maps.store import Workspace

MOST = 8
"""Places with a number."""

_TEXT = 0.045
"""Height of the numbers, a share of a map's extent; two maps share the width of the page."""

_DELAY_STEPS = (10.0, 20.0, 35.0, 55.0, 80.0)
"""Limits between the colours of stopped delay, seconds: those of levels of service at lights."""

_LEVELS = ("los-a", "los-b", "los-c", "los-d", "los-e", "los-f")


def ranked_places(case: CaseResult) -> dict[tuple[str, str], int]:
    """Numbers of the places that have changed most, from 1, by kind and name."""
    places = () if case.verdict is None else case.verdict.places
    names = dict.fromkeys((change.key.kind, change.key.place) for change in places)
    return {name: number for number, name in enumerate(list(names)[:MOST], start=1)}


def change_maps(case: CaseResult, workspace: Workspace | None) -> Markup | None:
    """Draw the map with the figures before and now; ``None`` where no place has changed.

    The map of before is drawn if the workspace still has it, else that of now.

    Raises
    ------
    OdscenError
        If the map cannot be loaded.
    """
    entry, baseline = case.entry, case.baseline
    ranks = ranked_places(case)
    if entry is None or baseline is None or not ranks:
        return None
    before = {key: _mean(values) for key, values in baseline.figures.items()}
    keys = dict.fromkeys(key for run in case.runs for key in run.figures if key.place)
    now = {key: _mean([run.figures.get(key) for run in case.runs]) for key in keys}
    old = map_before(entry, baseline.fingerprint.get("map", ""), workspace)
    sides = []
    for title, side, figures in (("Baseline", old or entry, before), ("Now", entry, now)):
        shapes = place_shapes(load_map(side).sumo.graph)
        names = {name: str(rank) for (_, name), rank in ranks.items()}
        drawn = place_map(
            shapes, _styles(figures), title=f"{case.name}: {title}", names=names, text=_TEXT
        )
        heading = "Baseline, on the map of now" if title == "Baseline" and not old else title
        if drawn is not None:
            sides.append(element("figure", element("figcaption", heading), drawn))
    return element("div", element("div", *sides, class_="side-by-side"), _legend())


def _mean(values: Sequence[float | None]) -> float | None:
    known = [value for value in values if value is not None]
    return sum(known) / len(known) if known else None


def _styles(figures: Mapping[FigureKey, float | None]) -> PlaceStyles:
    """Segments by mean speed and junctions by stopped delay, where enough vehicles passed."""
    found: PlaceStyles = {}
    for key, value in figures.items():
        passed = figures.get(key._replace(figure="vehicles")) or 0.0
        if value is None or passed < FEWEST:
            continue
        words = f"{key.entry.label} {key.entry.written(value)}, {passed:g} vehicles"
        if (key.kind, key.figure) == ("segment", "mean_speed"):
            step = int(np.searchsorted(SPEED_STEPS_KMH, value * 3.6, side="right"))
            found["segment", key.place] = (f"v{step}", words)
        elif (key.kind, key.figure) == ("junction", "waiting_time"):
            step = int(np.searchsorted(_DELAY_STEPS, value, side="right"))
            found["junction", key.place] = (_LEVELS[step], words)
    return found


def _legend() -> Markup:
    speeds = [(f"v{step}", words) for step, words in enumerate(_steps(SPEED_STEPS_KMH, "km/h"))]
    delays = list(zip(_LEVELS, _steps(_DELAY_STEPS, "s"), strict=True))
    idle = ("los-none", f"fewer than {FEWEST} vehicles")
    return element(
        "div",
        element("p", "Roads, mean speed:"),
        legend([*speeds, idle]),
        element("p", "Junctions, stopped delay per vehicle:"),
        legend(delays),
    )


def _steps(limits: Sequence[float], unit: str) -> list[str]:
    """Words of the classes between limits."""
    ends = [f"{limit:g}" for limit in limits]
    between = [f"{low} to {high} {unit}" for low, high in pairwise(ends)]
    return [f"under {ends[0]} {unit}", *between, f"over {ends[-1]} {unit}"]
