"""``odscen recording``: what recorded traffic has, how it lies on a map, and its scenes."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from odscen.cli.console import JsonOption, WorkspaceOption, log, print_json, print_table

if TYPE_CHECKING:
    from collections.abc import Mapping

app = typer.Typer(help="Recorded traffic: road users, agreement with a map, scenes, drivers.")


File = Annotated[
    Path, typer.Argument(help="Recorded traffic, or the folder of a run.", metavar="FILE")
]
MapOption = Annotated[
    str | None, typer.Option("--map", help="Map of the workspace that it lies on.")
]
WindowOption = Annotated[
    str, typer.Option(help="Part of it, in seconds or H:MM:SS.", metavar="FROM..TO")
]
ColumnsOption = Annotated[
    str, typer.Option(help="Columns of a table of no known schema.", metavar="time=T,x=X,y=Y,...")
]
PartOption = Annotated[
    str, typer.Option(help="Case of INTERACTION, or location of NGSIM.", metavar="NAME")
]
OffsetOption = Annotated[
    str, typer.Option(help="Metres and degrees to the frame of the map.", metavar="X,Y[,DEGREES]")
]


@app.command()
def show(
    file: File,
    on_map: MapOption = None,
    window: WindowOption = "",
    columns: ColumnsOption = "",
    part: PartOption = "",
    offset: OffsetOption = "",
    estimate: Annotated[
        bool, typer.Option("--estimate-offset", help="Move it onto the lanes of the map first.")
    ] = False,
    picture: Annotated[
        Path | None,
        typer.Option(help="Draw map and tracks, as .svg or .png.", metavar="FILE"),
    ] = None,
    scenes: Annotated[
        bool, typer.Option("--scenes", help="List hard braking, short TTC, lane changes and more.")
    ] = False,
    workspace: WorkspaceOption = None,
    as_json: JsonOption = False,
) -> None:
    """Say what recorded traffic has, how well it lies on a map, and which scenes are in it."""
    from odscen.app.exchange.recorded_traffic import read_recorded_traffic, show_recording
    from odscen.maps.store import Workspace

    recorded = read_recorded_traffic(file, window=window, columns=columns, part=part, offset=offset)
    entry = None if on_map is None else Workspace.open(workspace).map(on_map)
    shown = show_recording(recorded, entry, estimate=estimate, picture=picture)
    listed = shown.scenes.to_dicts() if scenes else None
    if as_json:
        print_json({**shown.summary, **({} if listed is None else {"scenes": listed})})
        return
    summary = dict(shown.summary)
    agreement, often = summary.pop("agreement", None), summary.pop("exposure")
    print_table("Recorded traffic", ("", ""), [(key, str(value)) for key, value in summary.items()])
    if agreement is not None:
        names = ("states", "on_lane", "wrong_way", "offset_median", "offset_95")
        rows = [
            (kind, agreement[kind]) for kind in ("vehicles", "pedestrians") if kind in agreement
        ]
        rows += [(f"road {row['road']}", row) for row in agreement.get("roads", ())]
        print_table(
            f"On map {on_map}",
            ("", *(name.replace("_", " ") for name in names)),
            [(kind, *(str(found.get(name, "")) for name in names)) for kind, found in rows],
        )
    print_table(
        f"Scenes in {often['hours']:.3f} h and {often['vehicle_km']} vehicle-km",
        ("", "count", "per hour", "per 100 km"),
        [
            (kind, *(str(found[key]) for key in ("count", "per_hour", "per_100_km")))
            for kind, found in often["scenes"].items()
        ],
    )
    if listed is not None:
        print_table(
            "Scenes",
            ("scene", "of", "with", "begin", "end", "value"),
            [
                (
                    *(str(row[key] or "") for key in ("kind", "id", "other")),
                    *(f"{row[key]:.2f}" for key in ("begin", "end", "value")),
                )
                for row in listed
            ],
        )
    if picture is not None:
        log(f"Wrote {picture}")


@app.command()
def add(
    files: Annotated[
        list[Path],
        typer.Argument(
            help="Recorded traffic, the files that belong to it, and perhaps its map.",
            metavar="FILE...",
        ),
    ],
    on_map: MapOption = None,
    workspace: WorkspaceOption = None,
    as_json: JsonOption = False,
) -> None:
    """Keep recorded traffic in the workspace, where the page lists it; a file may have any size."""
    from odscen.app.exchange.kept_recordings import SentPath, add_recording
    from odscen.base.errors import InputError
    from odscen.maps.store import Workspace

    for file in files:
        if not file.is_file():
            raise InputError("there is no such file", file=str(file))
    sent = [SentPath(file.name, file) for file in files]
    step = ""

    def tell(now: str, _share: float) -> None:
        nonlocal step
        if now != step and not as_json:
            log(f"{now[:1].upper()}{now[1:]}")
        step = now

    kept = add_recording(Workspace.open(workspace), sent, on_map=on_map, progress=tell)
    users, found = len(kept.about["users"]), len(kept.about["scenes"])
    if as_json:
        print_json(
            {"name": kept.name, "map": kept.about["map"], "road_users": users, "scenes": found}
        )
        return
    on = "no map" if kept.about["map"] is None else f"map {kept.about['map']}"
    log(f"Recording {kept.name}: {users} road users on {on}, {found} scenes")


@app.command()
def fit(
    file: File,
    out: Annotated[
        Path, typer.Option("-o", "--out", help="File of driver sets, JSON.", metavar="FILE")
    ],
    on_map: MapOption = None,
    model: Annotated[
        str | None,
        typer.Option(help="Of the drivers; without it that which is nearer.", metavar="IDM|Krauss"),
    ] = None,
    window: WindowOption = "",
    columns: ColumnsOption = "",
    part: PartOption = "",
    offset: OffsetOption = "",
    workspace: WorkspaceOption = None,
    as_json: JsonOption = False,
) -> None:
    """Fit drivers to recorded traffic, as driver sets of scenarios; a third judges the fit.

    With a map desired speeds are fitted, too, as shares of limits, and curves, gaps at junctions,
    changes of lanes and pedestrians are measured.
    """
    from odscen.app.exchange.recorded_traffic import fit_recorded_drivers, read_recorded_traffic
    from odscen.base.text_files import write_text
    from odscen.maps.store import Workspace

    recorded = read_recorded_traffic(file, window=window, columns=columns, part=part, offset=offset)
    entry = None if on_map is None else Workspace.open(workspace).map(on_map)
    fitted = fit_recorded_drivers(recorded, entry, model=model)
    write_text(out, fitted.drivers.model_dump_json(indent=2, exclude_defaults=True) + "\n")
    if as_json:
        print_json({**fitted.report, "file": str(out)})
        return
    for category, found in fitted.report["categories"].items():
        print_table(
            f"{category}: {found['fitted']} drivers fitted ({found['model']}), "
            f"{found['held_out']} held out",
            ("parameter", "5 %", "median", "95 %"),
            [
                (name, *(f"{spread[key]:.2f}" for key in ("low", "median", "high")))
                for name, spread in found["parameters"].items()
            ],
        )
    rows = [row for row in fitted.report["comparison"] if "recorded" in row]
    if rows:
        print_table(
            "Of those held out: mean, and distance of the distribution from the recorded one",
            ("of", "figure", "recorded", "fitted", "default", "nearer"),
            [
                (
                    row["category"],
                    f"{row['figure']}, {row['unit']}",
                    _tell_mean(row["recorded"]),
                    _tell_mean(row.get("fitted", {})),
                    _tell_mean(row.get("default", {})),
                    row["nearer"],
                )
                for row in rows
            ],
        )
    if "habits" in fitted.report:
        _print_habits(fitted.report["habits"])
    log(f"Wrote {out}")


@app.command()
def templates(
    file: File,
    on_map: Annotated[str, typer.Option("--map", help="Map of the workspace that it lies on.")],
    out: Annotated[
        Path, typer.Option("-o", "--out", help="Folder for scenarios and cases.", metavar="FOLDER")
    ],
    place_on: Annotated[
        str | None, typer.Option(help="Map of the scenarios, if it is another one.", metavar="MAP")
    ] = None,
    samples: Annotated[
        int, typer.Option(min=1, max=10_000, help="Cases drawn from the distribution.")
    ] = 100,
    seed: Annotated[int, typer.Option(min=0, help="Of the draws.")] = 0,
    window: WindowOption = "",
    columns: ColumnsOption = "",
    part: PartOption = "",
    offset: OffsetOption = "",
    workspace: WorkspaceOption = None,
    as_json: JsonOption = False,
) -> None:
    """Make scenarios with parameters of recorded scenes, and cases for odscen sweep."""
    from odscen.app.exchange.recorded_templates import write_recorded_templates
    from odscen.app.exchange.recorded_traffic import read_recorded_traffic
    from odscen.maps.store import Workspace

    recorded = read_recorded_traffic(file, window=window, columns=columns, part=part, offset=offset)
    store = Workspace.open(workspace)
    report = write_recorded_templates(
        recorded,
        store.map(on_map),
        out,
        place_on=None if place_on is None else store.map(place_on),
        samples=samples,
        seed=seed,
    )
    if as_json:
        print_json(report)
        return
    for name, found in report["templates"].items():
        others = sum(found["unfit"].values())
        title = f"{name}: {len(found['scenes'])} scenes, {others} that are none of it"
        if "distribution" in found:
            print_table(
                f"{title}; {found['per_100_km']} on 100 km",
                ("parameter", "5 %", "median", "95 %", "mean"),
                [
                    (parameter, *(f"{row[key]:.2f}" for key in ("p5", "p50", "p95", "mean")))
                    for parameter, row in found["distribution"]["parameters"].items()
                ],
            )
        else:
            log(title)
        for reason, count in found["unfit"].items():
            log(f"  {count}: {reason}")
        if "no_room" in found:
            log(found["no_room"])
        for written in found.get("files", ()):
            log(f"Wrote {out / written}")


@app.command()
def realism(
    run: Annotated[
        Path, typer.Argument(help="Folder of a run, or tracks of a simulator.", metavar="RUN")
    ],
    file: Annotated[
        Path, typer.Argument(help="Recorded traffic that it is held against.", metavar="FILE")
    ],
    on_map: MapOption = None,
    run_window: Annotated[
        str, typer.Option(help="Part of the run, in seconds or H:MM:SS.", metavar="FROM..TO")
    ] = "",
    window: WindowOption = "",
    columns: ColumnsOption = "",
    part: PartOption = "",
    offset: OffsetOption = "",
    html: Annotated[
        Path | None, typer.Option(help="Write a page with the distributions.", metavar="FILE")
    ] = None,
    workspace: WorkspaceOption = None,
    as_json: JsonOption = False,
) -> None:
    """Say how far a run is from recorded traffic: speeds, distances, places on lanes."""
    from odscen.app.exchange.recorded_traffic import compare_with_recording, read_recorded_traffic
    from odscen.base.text_files import write_text
    from odscen.maps.store import Workspace
    from odscen.reports.realism_report import render_realism

    driven = read_recorded_traffic(run, window=run_window)
    recorded = read_recorded_traffic(file, window=window, columns=columns, part=part, offset=offset)
    entry = None if on_map is None else Workspace.open(workspace).map(on_map)
    compared = compare_with_recording(driven, recorded, entry)
    if html is not None:
        write_text(html, render_realism(compared, run=run.name, recorded=file.name))
    if as_json:
        print_json(compared)
        return
    print_table(
        f"Of {run.name} from {file.name}: mean and distance, in brackets of the recording's halves",
        ("of", "figure", "recorded", "run", "distance", "divergence, bits"),
        [
            (
                row["group"],
                row["figure"].replace("_", " ") + (f", {row['unit']}" if row["unit"] else ""),
                f"{row['recorded']['mean']:.2f}",
                f"{row['run']['mean']:.2f}",
                *(
                    f"{row[name]:.3f}" + (f" ({halves[name]:.3f})" if halves else "")
                    for halves in [row["between_halves"]]
                    for name in ("distance", "divergence")
                ),
            )
            for row in compared["figures"]
            if row["group"] in ("vehicles", "pedestrians")
        ],
    )
    print_table(
        "Mean divergence, bits",
        ("kind", "run from recording", "halves of the recording"),
        [
            (
                kind,
                f"{row['divergence']:.3f}",
                "" if row["between_halves"] is None else f"{row['between_halves']:.3f}",
            )
            for kind, row in compared["kinds"].items()
        ],
    )
    if html is not None:
        log(f"Wrote {html}")


def _print_habits(habits: Mapping[str, Any]) -> None:
    rows = [
        (f"{category}: {name.replace('_', ' ')}", row)
        for category, curves in habits["curves"].items()
        for name, row in curves.items()
    ]
    rows += [
        (f"{kind}: {name} gap of lane changes, s", row[name])
        for kind, row in habits["lane_changes"].items()
        for name in ("lead", "lag")
        if name in row
    ]
    walkers = habits["pedestrians"]
    rows += [
        (f"pedestrian: {name.replace('_', ' ')}", walkers[name])
        for name in ("walking_speed", "accepted")
        if walkers.get(name)
    ]
    print_table(
        "In curves, lanes and on foot",
        ("", "road users", "5 %", "median", "95 %"),
        [
            (name, str(row["road_users"]), *(f"{row[key]:.2f}" for key in ("p5", "p50", "p95")))
            for name, row in rows
        ],
    )
    for kind, row in habits["lane_changes"].items():
        log(f"{kind}: {row['per_km']} lane changes on a km, {row['to_the_left']:.0%} to the left")
    gaps = [(f"lane {row['lane']}, {row['turn']}", row) for row in habits["gaps"]]
    gaps += [("pedestrians", walkers)] if walkers else []
    known = [(name, row) for name, row in gaps if row["critical_gap"] is not None]
    if known:
        print_table(
            "Critical gaps, s",
            ("of", "waited", "mean", "deviation"),
            [
                (
                    name,
                    str(row["waited"]),
                    *(str(row["critical_gap"][key]) for key in ("mean", "std")),
                )
                for name, row in known
            ],
        )


def _tell_mean(figure: Mapping[str, float | None]) -> str:
    """Mean of a figure, and how far its distribution is from the recorded one."""
    mean, distance = figure.get("mean"), figure.get("distance")
    if mean is None:
        return "none"
    return f"{mean:.2f}" if distance is None else f"{mean:.2f} ({distance:.2f} off)"
