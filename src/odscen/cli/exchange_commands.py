"""``odscen import`` and ``odscen export``: scenarios and runs from and to foreign formats."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from odscen.base.errors import NoMapError
from odscen.cli.console import (
    BuildMemoryOption,
    BuildMinutesOption,
    JsonOption,
    WorkspaceOption,
    as_rows,
    log,
    print_json,
    print_table,
    progress,
)
from odscen.formats import list_formats

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

_READ = {
    name: known_format
    for name, known_format in list_formats().items()
    if known_format.read is not None
}
_WRITTEN = {
    name: known_format
    for name, known_format in list_formats().items()
    if known_format.write is not None
}
_LISTED_SUFFIXES = list(dict.fromkeys(end for reader in _READ.values() for end in reader.suffixes))


def _check_written(text: str) -> str:
    if text not in list_formats():
        raise typer.BadParameter(f"{text!r} is not one of {', '.join(_WRITTEN)}")
    return text


def _check_read(text: str) -> str:
    if text not in list_formats():
        raise typer.BadParameter(f"{text!r} is not one of {', '.join(_READ)}")
    return text


OptionSettings = Annotated[
    list[str] | None,
    typer.Option(
        "--option",
        help="Something else that the format lets one choose. Repeatable.",
        metavar="NAME=VALUE",
    ),
]


def import_(
    file: Annotated[
        Path,
        typer.Argument(
            help="; ".join(f"{reader.id}: {reader.label}" for reader in _READ.values()) + ".",
            metavar="|".join(f"FILE{end}" for end in _LISTED_SUFFIXES),
        ),
    ],
    out: Annotated[
        Path, typer.Option(help="Scenario to write; of tracks, a table (.csv or .parquet).")
    ],
    of: Annotated[
        str | None,
        typer.Option(
            "--format",
            parser=_check_read,
            metavar="|".join(_READ),
            help="What the file is. (default: what its ending says)",
        ),
    ] = None,
    maps: Annotated[
        Path | None, typer.Option(help="Folder of maps, beside that of the file.")
    ] = None,
    on_map: Annotated[
        str | None,
        typer.Option(
            "--map", help="The map on which it plays: a file (.xodr) or the name of a map."
        ),
    ] = None,
    ego: Annotated[
        str | None,
        typer.Option(
            help="Of OpenSCENARIO what drives the ego: sumo, or its story. (default: story) Of "
            "recorded traffic who is the ego, by its id.",
            metavar="sumo|story|ID",
        ),
    ] = None,
    window: Annotated[
        str | None,
        typer.Option(
            help="Of recorded traffic: part of it, in seconds or H:MM:SS.", metavar="FROM..TO"
        ),
    ] = None,
    settings: OptionSettings = None,
    memory: BuildMemoryOption = None,
    minutes: BuildMinutesOption = None,
    workspace: WorkspaceOption = None,
    as_json: JsonOption = False,
) -> None:
    """Read a file as a scenario, and report on what it has.

    Of an OpenSCENARIO file each element is taken, approximated, ignored or refused. Arrays give the
    scenario that they were written of, with what was changed in them. Problems of the scenario are
    listed. Recorded traffic becomes a table of its tracks, and with a map a scenario.
    """
    from odscen.app.exchange.imports import import_file
    from odscen.maps.allowances import BuildLimits
    from odscen.maps.store import Workspace

    limits = BuildLimits(memory, minutes)
    options = _settings_as_options(settings)
    options |= {name: text for name, text in (("ego", ego), ("window", window)) if text is not None}
    store = Workspace.open(workspace)
    try:
        with progress(file.name) as step:
            read = import_file(
                store, file, out=out, of=of, maps=maps, on_map=on_map, options=options,
                limits=limits, progress=step,
            )  # fmt: skip
    except NoMapError as error:
        if not as_json:
            _print_lists(error.lists)
        raise
    if as_json and read.lists:
        problems = [
            {"where": problem.where, "message": problem.message} for problem in read.problems
        ]
        plan = None if read.plan_file is None else str(read.plan_file)
        lists = as_rows(read.lists)
        print_json({"file": str(out), "sweep": plan, **lists, "problems": problems})
        return
    if read.lists:
        _print_lists(read.lists)
    else:
        for problem in read.problems:
            log(f"{problem.severity}: {problem.where}: {problem.message}")
    log(f"Wrote {out}")
    if read.plan_file is not None:
        log(f"Wrote {read.plan_file}: odscen sweep {out} --plan {read.plan_file}")
    if as_json:
        print_json({"file": str(out), "problems": [asdict(problem) for problem in read.problems]})


def export(
    scenario: Annotated[
        Path,
        typer.Argument(
            help="Scenario, as JSON, GraphML or arrays; for formats of runs and with --as-run the "
            "folder of a run, or of several.",
            metavar="SCENARIO",
        ),
    ],
    to: Annotated[
        str,
        typer.Option(
            parser=_check_written,
            metavar="|".join(_WRITTEN),
            help="; ".join(f"{writer.id}: {writer.label}" for writer in _WRITTEN.values()) + ".",
        ),
    ],
    out: Annotated[Path, typer.Option("-o", "--out", help="Folder to write to.", metavar="DIR")],
    version: Annotated[
        str | None,
        typer.Option(help="Of OpenSCENARIO: 1.0 to 1.3. (default: 1.2)", metavar="VERSION"),
    ] = None,
    as_run: Annotated[
        bool,
        typer.Option(
            "--as-run",
            help="Write what happened in a run: each road user as a trajectory, and what "
            "lights showed. (openscenario; the formats of runs need no word)",
        ),
    ] = False,
    begin: Annotated[
        str | None,
        typer.Option(help="Of a run: from this second on.", metavar="SECONDS"),
    ] = None,
    end: Annotated[
        str | None,
        typer.Option(help="Of a run: up to this second.", metavar="SECONDS"),
    ] = None,
    settings: OptionSettings = None,
    workspace: WorkspaceOption = None,
    as_json: JsonOption = False,
) -> None:
    """Write a scenario, or a run, in another format.

    What a format cannot say is listed in a file NAME.export.json beside it.
    """
    from odscen.app.exchange.exports import export as export_scenario
    from odscen.app.exchange.exports import export_runs
    from odscen.maps.store import Workspace

    given = {"version": version, "begin": begin, "end": end}
    options = {name: value for name, value in given.items() if value is not None}
    options |= _settings_as_options(settings)
    of_runs = "run" in list_formats()[to].of and scenario.is_dir()
    write = export_runs if as_run or of_runs else export_scenario
    files = write(Workspace.open(workspace), scenario, out, to=to, options=options)
    for file in files:
        log(f"Wrote {file}")
    if as_json:
        print_json({"files": [str(file) for file in files]})


def _settings_as_options(settings: Sequence[str] | None) -> dict[str, str]:
    options = {}
    for setting in settings or ():
        name, equals, value = setting.partition("=")
        if not equals:
            raise typer.BadParameter(f"{setting!r} is not NAME=VALUE", param_hint="--option")
        options[name] = value
    return options


def _print_lists(lists: Mapping[str, Sequence[Any]]) -> None:
    rows = [
        (name, f"{row.file}:{row.line}", row.xpath.rpartition("/")[2], row.reason)
        for name in ("refused", "approximated", "ignored")
        for row in lists[name]
    ]
    print_table("Elements not taken as they are", ("", "line", "element", "reason"), rows)
    log(", ".join(f"{len(rows)} {name}" for name, rows in lists.items()))
