"""How signal groups were used: greens served, cycle failures, green in which nobody passed.

From what lights showed and, for vehicles, from trajectories of every step or nearly so.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from odscen.base.stored_files import tables
from odscen.figures.measures.figure import Basis, Better, Display, ReportSection, RunFigure
from odscen.records.row_text import among

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    import polars as pl

    from odscen.figures.measures.figure import RunData
    from odscen.records.light_programs import LightProgram, ShownGroup

SIGNALS_TABLE = "signals.csv"
"""Name of the table in the folder of figures."""

PASSING = 3.0
"""Seconds of green after a vehicle has passed that are not counted as unused."""

STOPPED = 0.1
"""m/s below which SUMO counts a vehicle as waiting."""

_DIGITS = 3
_PERCENT = Display("%", 100.0, 1)


def signal_use(
    programs: Sequence[LightProgram],
    states: pl.DataFrame,
    *,
    end: float,
    rows: pl.LazyFrame | None = None,
    ways: pl.DataFrame | None = None,
) -> pl.DataFrame:
    """Use of each signal group over a run.

    Parameters
    ----------
    states
        From :func:`odscen.runs.recorded.read_light_states`.
    end
        Simulated seconds.
    rows
        Trajectories as SUMO wrote them; without them, or without their lanes, nothing is known of
        vehicles.
    ways
        Of :class:`odscen.figures.by_place.lane_places.LanePlaces`: lanes that lead to junctions.

    Returns
    -------
    polars.DataFrame
        ``junction``, ``group``, ``movements``; ``greens``, their number, ``green``, their seconds,
        and ``mean_green``; of groups for vehicles also ``vehicles`` that passed in green or yellow,
        ``cycle_failures`` (greens at whose end a vehicle had not passed that was stopped before
        their begin) and ``unused_green`` (seconds of green from 3 s after a vehicle passed until
        the next one did); null where there are no trajectories.
    """
    import polars as pl

    greens = _find_greens(programs, states, end)
    table = greens.group_by("light", "group").agg(
        greens=pl.len(), green=(pl.col("end") - pl.col("begin")).sum()
    )
    listed = pl.DataFrame(
        [
            (number, light.id, light.junctions[0], group.id, ", ".join(group.movements), group.walk)
            for number, (light, group) in enumerate(_list_groups(programs))
        ],
        schema={
            "order": pl.Int64, "light": pl.String, "junction": pl.String, "group": pl.String,
            "movements": pl.String, "walk": pl.Boolean,
        },
        orient="row",
    )  # fmt: skip
    table = listed.join(table, on=["light", "group"], how="left").with_columns(
        pl.col("greens").fill_null(0).cast(pl.Int64), pl.col("green").fill_null(0.0)
    )
    passed = None if rows is None else _find_passages(programs, rows, ways)
    if passed is not None:
        used = _measure_use(greens, passed)
        table = table.join(used, on=["light", "group"], how="left")
    known = ("vehicles", "cycle_failures", "unused_green")
    missing = [name for name in known if name not in table.columns]
    none = pl.lit(None, dtype=pl.Float64)
    table = table.with_columns(none.alias(name) for name in missing)
    return (
        table.sort("order")
        .with_columns(
            mean_green=pl.col("green") / pl.col("greens").replace(0, None),
            **{
                name: pl.when(~pl.col("walk") & (passed is not None))
                .then(pl.col(name).fill_null(0))
                .otherwise(None)
                .cast(pl.Float64 if name == "unused_green" else pl.Int64)
                for name in known
            },
        )
        .select("junction", "group", "movements", "greens", "green", "mean_green", *known)
    )


def _list_groups(programs: Sequence[LightProgram]) -> list[tuple[LightProgram, ShownGroup]]:
    return [(light, group) for light in programs for group in light.groups]


def _find_greens(
    programs: Sequence[LightProgram], states: pl.DataFrame, end: float
) -> pl.DataFrame:
    """Greens of each group: ``light``, ``group``, ``number``, ``begin`` and ``end``, s."""
    import polars as pl

    links = {light.id: [(g.id, g.links[0]) for g in light.groups] for light in programs}
    found = []
    for (name,), shown in states.group_by("light", maintain_order=True):
        times = [*shown["time"].to_list(), end]
        letters = shown["state"].to_list()
        for group, link in links.get(str(name), ()):
            begin, number = None, 0
            for time, state in zip(times, [*letters, None], strict=True):
                green = state is not None and state[link] in "Gg"
                if green and begin is None:
                    begin = time
                elif not green and begin is not None:
                    found.append((str(name), group, number, begin, time))
                    begin, number = None, number + 1
    columns = {"light": pl.String, "group": pl.String, "number": pl.Int64}
    return pl.DataFrame(
        found, schema={**columns, "begin": pl.Float64, "end": pl.Float64}, orient="row"
    )


def _find_passages(
    programs: Sequence[LightProgram], rows: pl.LazyFrame, ways: pl.DataFrame | None
) -> pl.DataFrame | None:
    """Vehicles and the times at which they passed a light, and stopped before it if they did."""
    import polars as pl

    kinds = rows.collect_schema()
    if not {"vehicle_lane", "vehicle_speed"} <= set(kinds):
        return None
    inside = pl.DataFrame(
        [
            (lane, light.id, group.id)
            for light, group in _list_groups(programs)
            for lanes in group.lanes
            for lane in lanes[1:]
        ],
        schema=dict.fromkeys(("lane", "light", "group"), pl.String),
        orient="row",
    ).unique("lane", maintain_order=True)

    def seen(some: pl.LazyFrame, on: pl.DataFrame) -> pl.LazyFrame:
        return (
            some.filter(among("vehicle_lane", on["lane"], kinds["vehicle_lane"]))
            .select(
                time=pl.col("timestep_time").cast(pl.Float64),
                id=pl.col("vehicle_id").cast(pl.String),
                lane=pl.col("vehicle_lane").cast(pl.String),
            )
            .join(on.lazy(), on="lane")
        )

    passed = (
        seen(rows, inside)
        .group_by("id", "light", "group")
        .agg(passed=pl.col("time").min())
        .collect()
    )
    if ways is None or passed.is_empty():
        return passed.with_columns(stopped=pl.lit(None, dtype=pl.Float64))
    edges = _find_approaches(programs, ways)
    stopped = (
        seen(rows.filter(pl.col("vehicle_speed") < STOPPED), edges)
        .group_by("id", "light")
        .agg(stopped=pl.col("time").min())
        .collect()
    )
    return passed.join(stopped, on=["id", "light"], how="left")


def _find_approaches(programs: Sequence[LightProgram], ways: pl.DataFrame) -> pl.DataFrame:
    """Lanes on the way to each light."""
    import polars as pl

    edges: dict[str, set[str]] = {}
    lanes: dict[str, set[str]] = {}
    for lane, edge, movement in ways.select("lane", "approach", "movement").rows():
        edges.setdefault(lane, set()).add(edge)
        if movement is None:
            lanes.setdefault(edge, set()).add(lane)
    found = {
        (lane, light.id)
        for light, group in _list_groups(programs)
        for first in group.lanes
        for edge in edges.get(first[0], ())
        for lane in lanes.get(edge, ())
    }
    schema = {"lane": pl.String, "light": pl.String}
    return pl.DataFrame(sorted(found), schema=schema, orient="row")


def _measure_use(greens: pl.DataFrame, passed: pl.DataFrame) -> pl.DataFrame:
    """Vehicles, cycle failures and unused seconds of each group."""
    import polars as pl

    keys = ["light", "group"]
    shown = {
        (light, group): (begins, ends)
        for light, group, begins, ends in greens.sort("begin")
        .group_by(keys)
        .agg("begin", "end")
        .rows()
    }
    seen = {
        (light, group): (times, stopped)
        for light, group, times, stopped in passed.sort("passed")
        .group_by(keys)
        .agg("passed", "stopped")
        .rows()
    }
    rows = []
    for key in sorted({*shown, *seen}):
        times, stopped = seen.get(key, ([], []))
        rows.append(
            (*key, len(times), *_count_wasted_green(*shown.get(key, ([], [])), times, stopped))
        )
    names = dict.fromkeys(keys, pl.String)
    numbers = {"vehicles": pl.Int64, "cycle_failures": pl.Int64, "unused_green": pl.Float64}
    return pl.DataFrame(rows, schema={**names, **numbers}, orient="row")


def _count_wasted_green(
    begins: Sequence[float],
    ends: Sequence[float],
    times: Sequence[float],
    stopped: Sequence[float | None],
) -> tuple[int, float]:
    """Greens that did not clear the queue, and seconds of green in which nobody passed.

    Parameters
    ----------
    begins, ends
        Of the greens of a group, ascending.
    times, stopped
        When each vehicle passed, ascending, and when it was stopped before.
    """
    import numpy as np

    begin, end, at = (np.asarray(some, dtype=np.float64) for some in (begins, ends, times))
    since = np.array([np.inf if value is None else value for value in stopped], dtype=np.float64)
    # A vehicle waits through the greens that begin after its stop and end before it passes.
    first = np.searchsorted(begin, since, side="right")
    last = np.searchsorted(end, at, side="left")
    some = last > first
    change = np.zeros(len(begin) + 1, dtype=np.int64)
    np.add.at(change, first[some], 1)
    np.add.at(change, last[some], -1)
    failed = int(np.sum(np.cumsum(change) > 0))
    number = np.searchsorted(begin, at, side="right") - 1
    inside = number >= 0
    inside[inside] = at[inside] < end[number[inside]]
    which = np.arange(len(begin))
    marks = np.concatenate([begin, at[inside], end])
    of = np.concatenate([which, number[inside], which])
    order = np.lexsort((marks, of))
    gaps = np.diff(marks[order])[np.diff(of[order]) == 0]
    return failed, float(np.clip(gaps - PASSING, 0.0, None).sum())


def write_signal_use(table: pl.DataFrame, folder: Path) -> None:
    """Write the table beside those of traffic by place."""
    import polars.selectors as cs

    folder.mkdir(exist_ok=True)
    table.with_columns(cs.float().round(_DIGITS)).write_csv(folder / SIGNALS_TABLE)


def read_signal_use_table(file: Path) -> pl.DataFrame:
    """Inverse of :func:`write_signal_use`.

    Raises
    ------
    InputError
        If the table cannot be read.
    """
    import polars as pl

    text, whole, decimal = pl.String, pl.Int64, pl.Float64
    schema = {
        **dict.fromkeys(("junction", "group", "movements"), text),
        "greens": whole,
        "green": decimal,
        "mean_green": decimal,
        "vehicles": whole,
        "cycle_failures": whole,
        "unused_green": decimal,
    }
    with tables(str(file)):
        found = pl.read_csv(file, schema_overrides=schema)
        return found.select(list(schema)).fill_nan(None)


def _share_of_signals(run: RunData, part: str, whole: str) -> float | None:
    if run.signals is None:
        return None
    known = run.signals["vehicles"].is_not_null()
    total = float(run.signals[whole].filter(known).sum())
    return float(run.signals[part].filter(known).sum()) / total if total else None


FIGURES = (
    RunFigure(
        name="cycle_failures",
        unit="",
        label="cycle failures",
        definition="Share of the greens of all signal groups for vehicles at whose end a vehicle "
        "had not passed that was stopped before the green began.",
        source="HCM, 7th edition, cycle failure; SUMO's log of signal states and trajectories",
        better=Better.LOWER,
        tolerance="5 % or 0.01",
        basis=Basis.SIGNALS,
        display=_PERCENT,
        section=ReportSection.SIGNALS,
        note="greens that did not clear the queue",
        compute=lambda run: _share_of_signals(run, "cycle_failures", "greens"),
    ),
    RunFigure(
        name="unused_green",
        unit="",
        label="unused green",
        definition=f"Share of the green of all signal groups for vehicles from {PASSING:g} s after "
        "a vehicle passed, or the green began, until the next one did.",
        source="SUMO's log of signal states and trajectories",
        better=Better.LOWER,
        tolerance="5 % or 0.01",
        basis=Basis.SIGNALS,
        display=_PERCENT,
        section=ReportSection.SIGNALS,
        note="green in which no vehicle passed",
        compute=lambda run: _share_of_signals(run, "unused_green", "green"),
    ),
)
