"""``odscen recording``: what recorded traffic has, how it lies on a map, and its scenes."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

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
def fit(
    file: File,
    out: Annotated[
        Path, typer.Option("-o", "--out", help="File of driver sets, JSON.", metavar="FILE")
    ],
    on_map: MapOption = None,
    window: WindowOption = "",
    columns: ColumnsOption = "",
    part: PartOption = "",
    offset: OffsetOption = "",
    workspace: WorkspaceOption = None,
    as_json: JsonOption = False,
) -> None:
    """Fit drivers to recorded traffic, as driver sets of scenarios; a third judges the fit.

    Without a map desired speeds are not fitted, as they are shares of limits.
    """
    from odscen.app.exchange.recorded_traffic import fit_recorded_drivers, read_recorded_traffic
    from odscen.base.text_files import write_text
    from odscen.maps.store import Workspace

    recorded = read_recorded_traffic(file, window=window, columns=columns, part=part, offset=offset)
    entry = None if on_map is None else Workspace.open(workspace).map(on_map)
    fitted = fit_recorded_drivers(recorded, entry)
    write_text(out, fitted.drivers.model_dump_json(indent=2, exclude_defaults=True) + "\n")
    if as_json:
        print_json({**fitted.report, "file": str(out)})
        return
    for category, found in fitted.report["categories"].items():
        print_table(
            f"{category}: {found['fitted']} drivers fitted, {found['held_out']} held out",
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
            ("of", "figure", "recorded", "fitted", "default"),
            [
                (
                    row["category"],
                    f"{row['figure']}, {row['unit']}",
                    _tell_mean(row["recorded"]),
                    _tell_mean(row.get("fitted", {})),
                    _tell_mean(row.get("default", {})),
                )
                for row in rows
            ],
        )
    log(f"Wrote {out}")


def _tell_mean(figure: Mapping[str, float | None]) -> str:
    """Mean of a figure, and how far its distribution is from the recorded one."""
    mean, distance = figure.get("mean"), figure.get("distance")
    if mean is None:
        return "none"
    return f"{mean:.2f}" if distance is None else f"{mean:.2f} ({distance:.2f} off)"
