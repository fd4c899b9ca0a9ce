"""Traffic lights in the report: stages, what groups show in a cycle and showed in the run."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

from odscen.base.markup import Markup, element, join, number
from odscen.figures.measures.figure import ReportSection
from odscen.reports.page_templates import html_table, report_section
from odscen.reports.report_figures import card_grid, figure_cards
from odscen.reports.signal_pictures import (
    JunctionPictures,
    bar_chart,
    plan_chart,
    shown_bars,
    stage_diagram,
)
from odscen.reports.signal_sheet import detector_table, legend_picture, legend_shapes, split_table

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    import polars as pl

    from odscen.drawing.map_drawing import MapDrawing
    from odscen.records.light_programs import LightProgram, ShownPlan

SHOWN = 8
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


def signal_section(
    lights: LightsOfRun, values: Mapping[str, Any], *, drawing: MapDrawing | None = None
) -> Markup | None:
    """Cards over all lights; for each that is shown its stages, its time bars and its groups.

    Parameters
    ----------
    drawing
        Of the map, for the shapes of junctions.
    """
    if not lights.programs:
        return None
    chosen = _chosen(lights)
    parts = [
        _light(light, lights, JunctionPictures(light, drawing, ident=f"ground-{place}"))
        for place, light in enumerate(chosen)
    ]
    rest = len(lights.programs) - len(chosen)
    more = f"{rest} more lights are in figures/signals.csv." if rest else ""
    explained = (
        "a stage is what has green together; movements that give way are thin and dashed. Its "
        "split is its green and what follows until the next stage begins. The bars show green and "
        "yellow of each signal group in a cycle as planned, and below as shown in the run. A cycle "
        "failure is a green that did not clear the queue it began with; many of them call for more "
        "green. Unused green is what other groups could have had."
    )
    return report_section(
        "Traffic lights",
        card_grid(figure_cards(ReportSection.SIGNALS, values)),
        signal_legend(chosen),
        *parts,
        element("p", more) if more else None,
        explained=explained,
        ident="signals",
    )


def _chosen(lights: LightsOfRun) -> list[LightProgram]:
    failures: dict[str, int] = {}
    for junction, count in lights.use.select("junction", "cycle_failures").iter_rows():
        failures[junction] = failures.get(junction, 0) + int(count or 0)
    ranked = sorted(
        enumerate(lights.programs),
        key=lambda item: (not item[1].own, -failures.get(item[1].junctions[0], 0), item[0]),
    )
    return [light for _, light in ranked[:SHOWN]]


def signal_legend(lights: Sequence[LightProgram]) -> Markup:
    """What the shapes and colours of all pictures of these lights mean."""
    shapes = legend_shapes(lights)
    items = [element("span", legend_picture(shape), words) for shape, words in shapes]
    return element("div", *items, class_="legend signals")


def _light(light: LightProgram, lights: LightsOfRun, pictures: JunctionPictures) -> Markup:
    several = len(light.plans) > 1
    site = pictures.site()
    parts = [
        element("h3", f"Junction {', '.join(light.junctions)}, {_control(light)}"),
        pictures.ground(),
        element("div", site, detector_table(light), class_="site-box"),
        *(_plan(light, plan, pictures, named=several) for plan in light.plans),
        _as_shown(light, lights.states),
        _groups(light, lights.use),
    ]
    return join([part for part in parts if part])


def _control(light: LightProgram) -> str:
    words = {"fixed": "fixed-time", "actuated": "actuated"}[light.control]
    return f"{words}, {'program of the scenario' if light.own else 'program of the map'}"


def _plan(
    light: LightProgram, plan: ShownPlan, pictures: JunctionPictures, *, named: bool
) -> Markup:
    words = f"cycle {number(plan.cycle)} s, offset {number(plan.offset)} s"
    head = element("p", element("b", f"Plan {plan.id}: "), words) if named else None
    chart = element("div", plan_chart(light, plan), class_="chart-box", tabindex="0")
    parts = (head, stage_diagram(light, plan, pictures), chart, split_table(light, plan))
    return join([part for part in parts if part])


def _as_shown(light: LightProgram, states: pl.DataFrame) -> Markup:
    """Signal states of a stretch in the middle of the run, and when first stages began."""
    own = states.filter(states["light"] == light.id)
    times = own["time"].to_list()
    first = _first_stage(light)
    last = times[-1] if times else 0.0
    begin = max(min(last / 2.0, last - STRETCH), 0.0)
    # From the begin of a cycle on, so that stretches of fixed-time lights look alike.
    starts = [t for t, name in zip(times, own["name"].to_list(), strict=True) if name == first]
    begin = next((start for start in starts if start >= begin), begin)
    end = min(begin + STRETCH, last) if last > begin else begin + 1.0
    rows = [*zip(times, own["state"].to_list(), strict=True), (last, "")]
    chart = bar_chart(
        [(group.id, shown_bars(rows, group.links)) for group in light.groups],
        begin=begin,
        end=end,
        axis="seconds of the run",
        description=f"Signal states of junction {light.junctions[0]} in the run",
        marks=[start for start in starts if begin < start < end],
    )
    head = element("p", element("b", "As shown in the run"))
    return join([head, element("div", chart, class_="chart-box", tabindex="0")])


def _first_stage(light: LightProgram) -> str:
    return next((p.name for plan in light.plans for p in plan.phases if p.stage), "")


def _groups(light: LightProgram, use: pl.DataFrame) -> Markup:
    heads = (
        "Group", "Movements", "Greens", "Mean green, s", "Vehicles", "Cycle failures",
        "Unused green, s",
    )  # fmt: skip
    own = use.filter(use["junction"] == light.junctions[0])
    columns = (
        "group", "movements", "greens", "mean_green", "vehicles", "cycle_failures", "unused_green",
    )  # fmt: skip
    rows = [_row(row) for row in own.select(columns).iter_rows()]
    return html_table(heads, rows, label=f"Signal groups of junction {light.junctions[0]}")


def _row(row: Sequence[object]) -> Markup:
    name, movements, *values = row
    return element(
        "tr",
        element("th", str(name), scope="row"),
        element("td", str(movements)),
        *(element("td", _cell(value), class_="n") for value in values),
    )


def _cell(value: object) -> str:
    if value is None:
        return ""
    return number(value, 1) if isinstance(value, float) else str(value)
