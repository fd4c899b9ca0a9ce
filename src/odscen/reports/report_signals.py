"""Traffic lights in the report: stages, what groups show in a cycle and showed in the run."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

from odscen.base.markup import number
from odscen.figures.measures.figure import ReportSection
from odscen.reports.place_names import NO_NAMES
from odscen.reports.report_cards import figure_cards
from odscen.reports.signal_charts import bar_chart, plan_chart, shown_bars
from odscen.reports.signal_pictures import (
    JunctionPictures,
)
from odscen.reports.signal_sheet import (
    CONTROL_WORDS,
    DETECTOR_HEADS,
    SPLIT_HEADS,
    detector_rows,
    legend_picture,
    legend_shapes,
    split_rows,
)

if TYPE_CHECKING:
    from collections.abc import Mapping

    import polars as pl

    from odscen.base.markup import Markup
    from odscen.drawing.map_drawing import MapDrawing
    from odscen.records.light_programs import LightProgram
    from odscen.reports.place_names import PlaceNames

MOST_LIGHTS = 8
"""Lights that are drawn, at most: those with programs of the scenario, then the worst."""

STRETCH = 300.0
"""Seconds of the run of which the signal states are drawn, at most."""


class LightsOfRun(NamedTuple):
    """Programs, what lights showed, and how their groups were used; see the functions below.

    ``states`` are of :func:`odscen.runs.recorded.read_light_states`, ``use`` of
    :func:`odscen.figures.measures.signal_use.signal_use`.
    """

    programs: tuple[LightProgram, ...]
    states: pl.DataFrame
    use: pl.DataFrame


def signal_values(
    lights: LightsOfRun,
    values: Mapping[str, Any],
    *,
    drawing: MapDrawing | None = None,
    names: PlaceNames = NO_NAMES,
) -> dict[str, Any] | None:
    """Cards over all lights; for each that is shown its stages, its time bars and its groups.

    Parameters
    ----------
    drawing
        Of the map, for the shapes of junctions.
    names
        Of the junctions and of their approaches.
    """
    if not lights.programs:
        return None
    chosen = _choose_lights(lights)
    return {
        "cards": figure_cards(ReportSection.SIGNALS, values),
        "legend": [(legend_picture(shape), words) for shape, words in legend_shapes(chosen)],
        "split_heads": SPLIT_HEADS,
        "detector_heads": DETECTOR_HEADS,
        "lights": [
            _light_values(
                light, lights, JunctionPictures(light, drawing, ident=f"ground-{place}"), names
            )
            for place, light in enumerate(chosen)
        ],
        "more": len(lights.programs) - len(chosen),
    }


def _choose_lights(lights: LightsOfRun) -> list[LightProgram]:
    failures: dict[str, int] = {}
    for junction, count in lights.use.select("junction", "cycle_failures").iter_rows():
        failures[junction] = failures.get(junction, 0) + int(count or 0)
    ranked = sorted(
        enumerate(lights.programs),
        key=lambda item: (not item[1].own, -failures.get(item[1].junctions[0], 0), item[0]),
    )
    return [light for _, light in ranked[:MOST_LIGHTS]]


def _light_values(
    light: LightProgram, lights: LightsOfRun, pictures: JunctionPictures, names: PlaceNames
) -> dict[str, Any]:
    columns = (
        "group", "movements", "greens", "mean_green", "vehicles", "cycle_failures", "unused_green",
    )  # fmt: skip
    middle = f"j{light.junctions[0]}"
    used = lights.use.filter(lights.use["junction"] == light.junctions[0]).select(columns)
    return {
        "name": _name_light(light, names),
        "control": CONTROL_WORDS[light.control],
        "own": light.own,
        "ground": pictures.ground(),
        "site": pictures.site(),
        "detectors": detector_rows(light),
        "plans": [
            {
                "id": plan.id,
                "cycle": plan.cycle,
                "offset": plan.offset,
                "stages": pictures.stages(plan),
                "chart": plan_chart(light, plan),
                "splits": split_rows(light, plan),
            }
            for plan in light.plans
        ],
        "shown": _states_chart(light, lights.states),
        "groups": [
            [
                "" if value is None else number(value, 1) if isinstance(value, float) else value
                for value in (group, names.name_approaches(middle, movements), *rest)
            ]
            for group, movements, *rest in used.iter_rows()
        ],
    }


def _name_light(light: LightProgram, names: PlaceNames) -> str:
    """Names of the junctions of a light, with the ids by which the page has them."""
    known = [names.junctions.get(f"j{junction}") for junction in light.junctions]
    ids = ", ".join(light.junctions)
    if not all(known):
        return f"Junction {ids}"
    return f"{', '.join(filter(None, known))} (junction {ids})"


def _states_chart(light: LightProgram, states: pl.DataFrame) -> Markup:
    """Signal states of a stretch in the middle of the run, and when first stages began."""
    own = states.filter(states["light"] == light.id)
    times = own["time"].to_list()
    first = next((p.name for plan in light.plans for p in plan.phases if p.stage), "")
    last = times[-1] if times else 0.0
    begin = max(min(last / 2.0, last - STRETCH), 0.0)
    # From the begin of a cycle on, so that stretches of fixed-time lights look alike.
    starts = [t for t, name in zip(times, own["name"].to_list(), strict=True) if name == first]
    begin = next((start for start in starts if start >= begin), begin)
    end = min(begin + STRETCH, last) if last > begin else begin + 1.0
    rows = [*zip(times, own["state"].to_list(), strict=True), (last, "")]
    return bar_chart(
        [(group.id, shown_bars(rows, group.links)) for group in light.groups],
        begin=begin,
        end=end,
        axis="seconds of the run",
        description=f"Signal states of junction {light.junctions[0]} in the run",
        marks=[start for start in starts if begin < start < end],
    )
