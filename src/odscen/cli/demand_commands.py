"""``odscen demand``: traffic around the placed actors, from tables or made up, and how it fits."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from odscen.base.errors import InputError
from odscen.cli.console import JsonOption, WorkspaceOption, log, print_json, print_table
from odscen.cli.scenario_commands import ScenarioArgument

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from odscen.app.demand.traffic_files import TrafficReport


class CountUse(StrEnum):
    """What counts are for."""

    generate = "generate"
    compare = "compare"


app = typer.Typer(
    help="Traffic from tables of trips and counts, or made up, and how well it fits counts.",
    no_args_is_help=True,
)

OutOption = Annotated[
    Path | None,
    typer.Option("-o", "--out", help="File to write. (default: the scenario itself)"),
]
NameOption = Annotated[
    str | None, typer.Option("--id", help="Name of this part of the demand. (default: its kind)")
]
MixOption = Annotated[
    str | None,
    typer.Option(help="Relative shares of categories.", metavar="car=8,bus=1"),
]
DayOption = Annotated[
    str | None,
    typer.Option("--day", help="Day profile: weekday, weekend, or one of the scenario's own."),
]

ArrivalsOption = Annotated[
    str,
    typer.Option(
        help="random: as in a Poisson process, the numbers are means over seeds; even: as many as "
        "are said, with every seed.",
        metavar="random|even",
    ),
]

TrialOption = Annotated[
    bool,
    typer.Option(
        "--trial/--no-trial", help="Run the busiest hour, and have as many trips as it carries."
    ),
]


@app.command("import")
def import_(
    scenario: ScenarioArgument,
    files: Annotated[
        list[Path] | None,
        typer.Argument(
            help="Files of any kind: VISUM and SUMO matrices, edgeData, turns, detectors, taz, "
            "tables with any titles (CSV, Excel).",
            metavar="[FILE]...",
        ),
    ] = None,
    trips: Annotated[
        Path | None,
        typer.Option(
            "--od", help="Table of trips: from,to,trips[,begin,end], or square.", metavar="CSV"
        ),
    ] = None,
    inputs: Annotated[
        Path | None,
        typer.Option(
            help="Table of vehicle inputs: segment[,direction],7:00,7:15,...", metavar="CSV"
        ),
    ] = None,
    counts: Annotated[
        Path | None,
        typer.Option(
            help="Table of counts: place,begin,end,count, or place,7:00,7:15,...", metavar="CSV"
        ),
    ] = None,
    profile: Annotated[
        Path | None,
        typer.Option(help="Table of a day profile: share, or time and share.", metavar="CSV"),
    ] = None,
    zones: Annotated[
        Path | None, typer.Option(help="Table of zones: zone,segment.", metavar="CSV")
    ] = None,
    stations: Annotated[
        Path | None,
        typer.Option(
            help="Where the stations of a FILE are: a table with station and lon,lat or x,y or "
            "edge, or SUMO's definitions of detectors.",
        ),
    ] = None,
    columns: Annotated[
        str | None,
        typer.Option(
            help="Which column of a FILE has what; kept for tables with the same titles.",
            metavar="station=Zst,time=Zeit,count=Kfz",
        ),
    ] = None,
    interval: Annotated[
        float | None,
        typer.Option(min=0.1, help="Minutes that a row of a FILE counts, where it does not say."),
    ] = None,
    date: Annotated[
        str | None, typer.Option(help="The day that is taken of a FILE.", metavar="2026-03-02")
    ] = None,
    time_zone: Annotated[
        str | None,
        typer.Option(help="Of the stations, for stamps in UTC.", metavar="Europe/Berlin"),
    ] = None,
    use: Annotated[
        CountUse, typer.Option(help="Make traffic that meets counts, or compare it with them.")
    ] = CountUse.generate,
    name: NameOption = None,
    mix: MixOption = None,
    day: DayOption = None,
    arrivals: ArrivalsOption = "random",
    out: OutOption = None,
    workspace: WorkspaceOption = None,
    as_json: JsonOption = False,
) -> None:
    """Read trips, counts, zones, inputs, day profiles or detectors into a scenario.

    Of a FILE it is found out what it is, and reported what was taken and what was not. The scenario
    holds the values; the files are not needed any more. What has the same name is replaced.
    """
    from odscen.app import scenarios
    from odscen.app.demand import demands, traffic_files
    from odscen.formats.office.traffic_file import ReadingOptions
    from odscen.maps.store import Workspace

    store = Workspace.open(workspace)
    document = scenarios.read_scenario(scenario)
    common: dict[str, Any] = {"mix": parse_mix(mix)} if mix else {}
    tables: dict[demands.TableKind, Path | None] = {
        "zones": zones,
        "profile": profile,
        "inputs": inputs,
        "od": trips,
        "counts": counts,
    }
    given = {kind: file for kind, file in tables.items() if file is not None}
    if not given and not files:
        raise InputError(
            "name a FILE to import, or a table: --od, --inputs, --counts, --profile or --zones"
        )
    for kind, file in given.items():
        more = {"arrivals": arrivals} if kind in ("inputs", "od") else {}
        document = demands.import_demand(
            store, document, file, kind=kind, name=name, day=day, **common, **more
        )
    options = ReadingOptions(
        columns=_parse_columns(columns),
        interval=None if interval is None else interval * 60.0,
        date=date,
        time_zone=time_zone,
    )
    reports = []
    for given_file in files or ():
        document, report = traffic_files.import_traffic(
            store, document, given_file, stations=stations, options=options, name=name,
            use=use.value, profile=day, **common,
        )  # fmt: skip
        _print_traffic(given_file, report)
        reports.append({"file": str(given_file), **report.to_dict()})
    if profile is not None:
        own = next(part for part in document.demand.profiles if part.id == (name or "profile"))
        hours, rest = divmod(round((own.begin or 0.0) / 60.0), 60)
        minutes = own.seconds / len(own.shares) / 60.0
        log(f"Profile {own.id}: {len(own.shares)} slices of {minutes:g} min from {hours}:{rest:02}")
    path = scenarios.write_scenario(document, out or scenario)
    _report_demand(document.demand.model_dump(mode="json"), path, as_json=as_json, reports=reports)


_SHOWN_ROWS = 12
"""Rows of each list of the report that are printed; JSON has all."""


def _parse_columns(text: str | None) -> dict[str, str]:
    columns_by_role = {}
    for part in (text or "").split(","):
        if not part.strip():
            continue
        role, equals, title = part.partition("=")
        if not equals or not title.strip():
            raise InputError(f"columns are written as station=TITLE,time=TITLE, not {text!r}")
        columns_by_role[role.strip()] = title.strip()
    return columns_by_role


def _print_traffic(file: Path, report: TrafficReport) -> None:
    log(f"{file}: {report.words}")
    if report.columns:
        log(
            "columns: "
            + ", ".join(f"{role} is {title!r}" for role, title in report.columns.items())
        )
    for title, rows in (
        ("left out", [f"{where}: {reason}" for where, reason in report.left_out]),
        ("not on the map", [f"{name}: {reason}" for name, reason in report.unplaced.items()]),
        ("note", report.notes),
        ("doubtful", report.doubts),
    ):
        for row in rows[:_SHOWN_ROWS]:
            log(f"{title}: {row}")
        if len(rows) > _SHOWN_ROWS:
            log(f"{title}: and {len(rows) - _SHOWN_ROWS} more; --json lists all")
    if report.next:
        log(f"next: {report.next}")


@app.command()
def add(
    scenario: ScenarioArgument,
    fill: Annotated[
        float | None, typer.Option(min=0, max=1, help="Share of the vehicles that fit.")
    ] = None,
    per_km: Annotated[
        float | None, typer.Option(min=0, help="Vehicles per kilometre of lane.")
    ] = None,
    trips: Annotated[float | None, typer.Option(min=0, help="Trips until the end.")] = None,
    sized: Annotated[
        bool,
        typer.Option("--sized", help="As many trips as the network carries, tried by runs."),
    ] = False,
    name: NameOption = None,
    mix: MixOption = None,
    day: DayOption = None,
    arrivals: ArrivalsOption = "random",
    out: OutOption = None,
    workspace: WorkspaceOption = None,
    as_json: JsonOption = False,
) -> None:
    """Add background traffic: vehicles that come and go anywhere in the region.

    One of --fill, --per-km and --trips says how many; the first two say how many are to be on the
    road at a time. With --sized, that is how many at most, and without one of them what the
    capacities of the junctions propose.
    """
    from odscen.app import scenarios
    from odscen.app.demand import demands, sized_demand
    from odscen.maps.store import Workspace

    amounts = {"fill": fill, "per_km": per_km, "trips": trips}
    fields: dict[str, Any] = {key: value for key, value in amounts.items() if value is not None}
    fields["arrivals"] = arrivals
    if mix:
        fields["mix"] = parse_mix(mix)
    if day:
        fields["profile"] = day
    store = Workspace.open(workspace)
    document = scenarios.read_scenario(scenario)
    name = name or "background"
    if sized and not amounts.keys() & fields.keys():
        fields["trips"] = sized_demand.proposed_background(store, document, **fields)
        log(f"Proposed by the capacities of the junctions: {fields['trips']:,.0f} trips")
    document = demands.add_background(store, document, name=name, **fields)
    if sized:
        document, found = sized_demand.sized(store, document, only=name, tell=log)
        log(found.words)
    path = scenarios.write_scenario(document, out or scenario)
    _report_demand(document.demand.model_dump(mode="json"), path, as_json=as_json)


@app.command()
def inflow(
    scenario: ScenarioArgument,
    segment: Annotated[str, typer.Option(help="Segment on which they drive in.")],
    per_hour: Annotated[
        float | None, typer.Option(min=0, help="Vehicles an hour, on all lanes.")
    ] = None,
    quarters: Annotated[
        str | None,
        typer.Option(
            help="Or vehicles an hour in each quarter of an hour from the start on.",
            metavar="420,510,600,480",
        ),
    ] = None,
    peak_hour_factor: Annotated[
        float | None,
        typer.Option(
            min=0.25, max=1, help="Volume of an hour by four times that of its busiest quarter."
        ),
    ] = None,
    arrivals: ArrivalsOption = "random",
    direction: Annotated[
        str | None, typer.Option(help="forward or backward, where both lead in.")
    ] = None,
    lanes: Annotated[
        str | None, typer.Option(help="Ids of OpenDRIVE lanes. (default: all)", metavar="-1,-2")
    ] = None,
    to: Annotated[
        str | None,
        typer.Option(
            help="Zones or segments and their shares. (default: all ends)", metavar="r8=3,r9=1"
        ),
    ] = None,
    name: NameOption = None,
    mix: MixOption = None,
    day: DayOption = None,
    out: OutOption = None,
    workspace: WorkspaceOption = None,
    as_json: JsonOption = False,
) -> None:
    """Add vehicles that drive into the region at its boundary, at the speed of traffic there.

    Where they can: odscen demand entries.
    """
    from odscen.app import scenarios
    from odscen.app.demand import demands
    from odscen.maps.store import Workspace

    if (per_hour is None) == (quarters is None):
        raise InputError("say how many vehicles come: by --per-hour or by --quarters")
    fields: dict[str, Any] = {"segment": segment, "direction": direction, "arrivals": arrivals}
    if quarters is None:
        fields["per_hour"] = per_hour
    else:
        rates = _split_rates(quarters)
        fields |= {"volumes": rates, "interval": 900.0, "end": 900.0 * len(rates)}
    if peak_hour_factor is not None:
        fields["peak_hour_factor"] = peak_hour_factor
    if lanes:
        fields["lanes"] = _lane_ids(lanes)
    if to:
        fields["to"] = tuple(parse_shares(to, example="r8=3,r9=1").items())
    if mix:
        fields["mix"] = parse_mix(mix)
    if day:
        fields["profile"] = day
    store = Workspace.open(workspace)
    document = scenarios.read_scenario(scenario)
    document = demands.add_input(store, document, name=name, **fields)
    path = scenarios.write_scenario(document, out or scenario)
    _report_demand(document.demand.model_dump(mode="json"), path, as_json=as_json)


@app.command("entries")
def list_entries(
    scenario: ScenarioArgument, workspace: WorkspaceOption = None, as_json: JsonOption = False
) -> None:
    """List where vehicles can drive into the region of a scenario: segment, direction, lanes."""
    from odscen.app import maps, scenarios
    from odscen.app.demand import demands
    from odscen.maps.store import Workspace

    document = scenarios.read_scenario(scenario)
    graph = maps.map_of(Workspace.open(workspace), document).sumo.graph
    entries = demands.find_entries(document, graph)
    rows = [
        (entry.segment, entry.direction, [lane.lane for lane in entry.lanes]) for entry in entries
    ]
    if as_json:
        keys = ("segment", "direction", "lanes")
        print_json({"entries": [dict(zip(keys, row, strict=True)) for row in rows]})
        return
    listed = [(segment, way, ", ".join(map(str, lanes))) for segment, way, lanes in rows]
    print_table("", ("segment", "direction", "lanes"), listed)


@app.command()
def weekday(
    map_name: Annotated[str, typer.Option("--map", help="Map to use, the whole of it.")],
    trips: Annotated[
        float, typer.Option(min=1, help="Trips of the day, if the junctions carry so many.")
    ] = 51_000,
    day: Annotated[str, typer.Option(help="Day profile: weekday or weekend.")] = "weekday",
    seed: Annotated[int, typer.Option(min=0, help="Seed of the scenario.")] = 0,
    trial: TrialOption = True,
    out: Annotated[
        Path | None, typer.Option("-o", "--out", help="File. (default: in the workspace)")
    ] = None,
    workspace: WorkspaceOption = None,
    as_json: JsonOption = False,
) -> None:
    """Make a day of traffic on a whole map, 24 hours from midnight on.

    Trips start and end anywhere, fewer of them where junctions would be too busy; what that is
    based on is printed. If the junctions do not carry as many as asked for, there are fewer. Then
    the busiest hour is run, and there are as many trips as it carries.
    """
    from odscen.app import scenarios
    from odscen.app.demand import demands, sized_demand
    from odscen.maps.store import Workspace

    store = Workspace.open(workspace)
    document, load = demands.whole_day(store, map_name, trips=trips, day=day, seed=seed)
    log(
        f"{load.trips:,.0f} trips, {load.peak_trips:,.0f} in the busiest hour; then the busiest "
        f"junction approach, {load.place}, gets {load.volume:,.0f} of the {load.capacity:,.0f} "
        f"vehicles that it carries ({load.volume / load.capacity:.0%})"
    )
    sizing = None
    if trial:
        document, sizing = sized_demand.sized(store, document, tell=log)
        log(sizing.words)
    path = scenarios.write_scenario(
        document, out or store.scenarios / f"{map_name}-{day}{scenarios.SUFFIX}"
    )
    log(f"Wrote {path}")
    if as_json:
        found = load if sizing is None else load.times(sizing.share)
        more = {} if sizing is None else sizing.to_dict()
        print_json({"file": str(path), **found._asdict(), **more})


@app.command()
def size(
    scenario: ScenarioArgument,
    name: Annotated[
        str | None,
        typer.Option("--id", help="One of them. (default: all matrices and background traffic)"),
    ] = None,
    out: OutOption = None,
    workspace: WorkspaceOption = None,
    as_json: JsonOption = False,
) -> None:
    """Make matrices and background traffic as few as the network carries, tried by runs.

    The busiest hour is run with a tenth more than what is written; the largest amount is taken with
    which the verdict is usable. What fits stays as it is.
    """
    from odscen.app import scenarios
    from odscen.app.demand import sized_demand
    from odscen.maps.store import Workspace

    document = scenarios.read_scenario(scenario)
    document, sizing = sized_demand.sized(Workspace.open(workspace), document, only=name, tell=log)
    path = scenarios.write_scenario(document, out or scenario)
    log(sizing.words)
    log(f"Wrote {path}")
    if as_json:
        print_json({"file": str(path), "trips": sizing.trips, **sizing.to_dict()})


def parse_mix(text: str) -> dict[str, float]:
    """Shares of categories from ``car=8,bus=1``.

    Raises
    ------
    InputError
        If it is not written so; names of categories are checked with the document.
    """
    return parse_shares(text, example="car=8,bus=1")


def parse_shares(text: str, *, example: str) -> dict[str, float]:
    """Shares by name from a text such as the example.

    Raises
    ------
    InputError
        If it is not written so.
    """
    shares: dict[str, float] = {}
    for part in text.split(","):
        name, _, share = part.strip().partition("=")
        try:
            shares[name.strip()] = float(share or "1")
        except ValueError:
            raise InputError(f"shares are written as {example}, not {text!r}") from None
    return shares


def _split_rates(text: str) -> tuple[float, ...]:
    """Vehicles of each quarter of an hour, from their rates an hour."""
    try:
        return tuple(float(part) / 4.0 for part in text.split(","))
    except ValueError:
        raise InputError(f"quarters are written as 420,510,600,480, not {text!r}") from None


def _lane_ids(text: str) -> tuple[int, ...]:
    try:
        return tuple(int(part) for part in text.split(","))
    except ValueError:
        raise InputError(f"lanes are written as -1,-2, not {text!r}") from None


def _report_demand(
    demand: dict[str, Any],
    path: Path,
    *,
    as_json: bool,
    reports: Sequence[Mapping[str, Any]] = (),
) -> None:
    sizes = {
        "zones": len(demand["zones"]),
        "profiles": len(demand["profiles"]),
        "inputs": len(demand["inputs"]),
        "trips": sum(row[2] for part in demand["matrices"] for row in part["trips"]),
        "counts": sum(len(part["rows"]) for part in demand["counts"]),
        "background": len(demand["background"]),
    }
    log(", ".join(f"{value:g} {name}" for name, value in sizes.items()))
    log(f"Wrote {path}")
    if as_json:
        print_json({"file": str(path), **sizes, **({"files": list(reports)} if reports else {})})
