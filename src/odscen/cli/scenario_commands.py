"""``odscen generate``, ``check`` and ``replay``: scenarios before they run."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from odscen.base.errors import InputError, in_file
from odscen.base.shown import visible
from odscen.cli.console import (
    JsonOption,
    WorkspaceOption,
    error_fields,
    log,
    option_settings,
    print_json,
    print_table,
    progress,
)

if TYPE_CHECKING:
    from odscen.learning.fill import CheckedFill
    from odscen.maps.store import Workspace

_MOST_REMARKS = 10
"""Repairs of a fill that are printed."""

ScenarioArgument = Annotated[
    Path, typer.Argument(help="Scenario, as JSON, GraphML or arrays.", metavar="SCENARIO")
]


def generate(
    map_name: Annotated[
        str | None, typer.Option("--map", help="Map to use. (default: drawn from the catalogue)")
    ] = None,
    count: Annotated[int, typer.Option(min=1, max=100_000, help="How many scenarios.")] = 1,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the first; the others count on.")] = 0,
    fill: Annotated[
        float | None,
        typer.Option(min=0, max=1, help="Share of the largest number of actors that fit."),
    ] = None,
    roi_segments: Annotated[
        int | None, typer.Option(min=1, help="Size of the region of interest in segments.")
    ] = None,
    config: Annotated[
        Path | None, typer.Option(help="Sampling configuration, TOML or JSON.", dir_okay=False)
    ] = None,
    generator: Annotated[
        str | None,
        typer.Option(
            metavar="NAME",
            help="Places the actors: package.module:Class, or a name of an installed package.",
        ),
    ] = None,
    generator_cmd: Annotated[
        str | None,
        typer.Option(
            metavar="COMMAND",
            help='Another program that places them: "program {in}.npz {out}.npz".',
        ),
    ] = None,
    generator_option: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME=VALUE",
            help="An option of the generator; the value as JSON or text. Repeatable.",
        ),
    ] = None,
    generator_timeout: Annotated[
        float, typer.Option(min=1, metavar="SECONDS", help="Time that it may take for a scenario.")
    ] = 600.0,
    warm_up: Annotated[
        float,
        typer.Option(
            min=0,
            max=3600,
            metavar="SECONDS",
            help="Drive what a generator places for so long before the scenario begins.",
        ),
    ] = 0.0,
    out: Annotated[
        Path | None, typer.Option(help="Folder to write to. (default: the workspace's scenarios)")
    ] = None,
    workspace: WorkspaceOption = None,
    as_json: JsonOption = False,
) -> None:
    """Sample scenarios on a map: region, weather, actors, goals. The same seed, the same bytes."""
    from odscen.app import generation, scenarios
    from odscen.app.generators import GeneratorDoor
    from odscen.maps.store import Workspace
    from odscen.scenario.sampling.generation_settings import GenerationSettings

    settings = GenerationSettings(
        map_name=map_name,
        count=count,
        seed=seed,
        fill=fill,
        roi_segments=roi_segments,
        config=scenarios.read_config(config),
    )
    door = None
    if generator is not None or generator_cmd is not None:
        given = option_settings(generator_option or (), element="--generator-option")
        door = GeneratorDoor(generator, generator_cmd, generator_timeout, given, warm_up)
    elif generator_option:
        raise InputError("--generator-option is of a generator: name one with --generator")
    elif warm_up:
        raise InputError("--warm-up is for what a generator places: name one with --generator")
    fills: dict[str, CheckedFill] = {}
    with progress("generating") as step:
        paths = generation.generate(
            Workspace.open(workspace),
            settings=settings,
            out=out,
            generator=door,
            filled=fills.__setitem__,
            progress=step,
        )
    rows = [
        {"file": str(path), "name": scenario.name, "map": scenario.map.name, "seed": scenario.seed}
        | {"segments": len(scenario.roi), "actors": len(scenario.actors)}
        | ({"fill": _fill_row(fills[scenario.name])} if scenario.name in fills else {})
        for path, scenario in ((path, scenarios.read_scenario(path)) for path in paths)
    ]
    for row in rows:
        log(f"{row['file']}: {row['actors']} actors on {row['segments']} segments of {row['map']}")
        if (checked := fills.get(str(row["name"]))) is not None:
            _show_remarks(checked)
    if as_json:
        print_json({"scenarios": rows})


def _show_remarks(checked: CheckedFill) -> None:
    """Say what was repaired of a fill."""
    for row, what, column, why in checked.remarks[:_MOST_REMARKS]:
        log(f"  road user {row} {what}: {column}: {why}")
    if len(checked.remarks) > _MOST_REMARKS:
        log(f"  and {len(checked.remarks) - _MOST_REMARKS} more; --json has all")


def _fill_row(checked: CheckedFill) -> dict[str, Any]:
    return {
        "given": checked.given,
        "kept": len(checked.actors),
        "remarks": [remark._asdict() for remark in checked.remarks],
    }


def check(
    scenarios: Annotated[
        list[Path] | None,
        typer.Argument(help="Scenarios, as JSON, GraphML or arrays.", metavar="SCENARIO..."),
    ] = None,
    run: Annotated[
        Path | None,
        typer.Option(
            metavar="RUN",
            help="A finished run instead, its folder or its name: whether its road users moved "
            "as bodies and drivers do.",
        ),
    ] = None,
    workspace: WorkspaceOption = None,
    as_json: JsonOption = False,
) -> None:
    """Check scenarios, or the motion of a run: everything that is wrong, where and why.

    Exit code 0 without errors (warnings are allowed), 2 with errors. Of several files, one that
    cannot be read does not keep the others from being checked. Of a run: 0 if its motion is
    plausible, 1 if something is implausible; hard braking and what moves by force are only shown.
    """
    from odscen.maps.store import Workspace

    if (run is None) == (not scenarios):
        raise typer.BadParameter("give scenarios, or a run with --run", param_hint="SCENARIO...")
    if run is not None:
        raise typer.Exit(_check_run(Workspace.open(workspace), run, as_json=as_json))
    assert scenarios
    store = Workspace.open(workspace)
    if len(scenarios) == 1:  # an error of reading it is the command's own
        files = [_check_file(store, scenarios[0])]
    else:
        files = [_checked_or_refused(store, path) for path in scenarios]
    valid = all(file["valid"] for file in files)
    if as_json:
        print_json(files[0] if len(files) == 1 else {"valid": valid, "files": files})
    raise typer.Exit(0 if valid else 2)


def _check_run(store: Workspace, run: Path, *, as_json: bool) -> int:
    """Check the motion of a run, print what was found, and return the exit code."""
    from odscen.app.running.motion_checks import motion_report

    report = motion_report(store, run)
    if as_json:
        print_json(report)
    else:
        keys = ("kind", "category", "cause", "findings", "users", "value", "unit", "bound")
        rows = [tuple(_format_rounded(row[key]) for key in keys) for row in report["counts"]]
        print_table("", keys, rows)
        for row in report["findings"]:
            if row["counted"]:
                partner = f" and {row['partner']}" if row["partner"] else ""
                log(
                    visible(
                        f"{row['begin']:.1f} s: {row['id']}{partner}, {row['category']}: "
                        f"{row['kind']} {row['value']:.2f} {row['unit']} "
                        f"(bound {row['bound']:.2f}) at x {row['x']:.1f} m, y {row['y']:.1f} m, "
                        f"lane {row['lane'] or '-'}; {row['cause']}"
                    )
                )
    log(
        f"{report['run']}: {report['implausible']} findings of implausible motion, "
        f"{report['hard_braking']} of hard braking, {report['forced']} moved by force"
    )
    return 1 if report["implausible"] else 0


def _format_rounded(value: object) -> object:
    return round(value, 2) if isinstance(value, float) else value


def _checked_or_refused(workspace: Workspace, path: Path) -> dict[str, Any]:
    """One of several files: one that cannot be read, or has no map, is a file with an error."""
    try:
        return _check_file(workspace, path)
    except InputError as error:
        log(f"error: {error}")
        return {"file": str(path), "valid": False, "error": error_fields(error)}


def _check_file(workspace: Workspace, path: Path) -> dict[str, Any]:
    from odscen.app.scenarios import check_scenario, read_scenario

    with in_file(str(path)):
        problems = check_scenario(workspace, read_scenario(path))
    errors = sum(problem.severity == "error" for problem in problems)
    for problem in problems:
        log(f"{problem.severity}: {problem.where}: {problem.message}")
    log(f"{path}: {errors} errors, {len(problems) - errors} warnings")
    return {
        "file": str(path),
        "valid": errors == 0,
        "errors": errors,
        "warnings": len(problems) - errors,
        "problems": [asdict(problem) for problem in problems],
    }


def replay(
    scenario: ScenarioArgument,
    trajectory: Annotated[
        Path,
        typer.Argument(help="CSV or Parquet with time, x, y; or a run's folder.", metavar="SOURCE"),
    ],
    actor: Annotated[str, typer.Option(help="Actor of the scenario that is to do the same.")],
    of: Annotated[
        str | None, typer.Option(help="Who was recorded. (default: the only one)")
    ] = None,
    begin: Annotated[
        float | None, typer.Option(min=0, help="Second of the run. (default: as recorded)")
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option("-o", "--out", help="File to write. (default: the scenario itself)"),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Let an actor of a scenario move as one was recorded; SUMO's traffic reacts to it.

    The recording becomes part of the scenario, as a rule of it.
    """
    from odscen.app.running.trajectories import attach_trajectory
    from odscen.app.scenarios import read_scenario, write_scenario

    document = attach_trajectory(
        read_scenario(scenario), trajectory, actor=actor, of=of, begin=begin
    )
    rule = document.rules[-1]
    path = write_scenario(document, out or scenario)
    log(f"{path}: rule {rule.id}")
    if as_json:
        print_json({"file": str(path), "rule": rule.id})


def variant(
    parent: Annotated[Path, typer.Argument(help="Scenario to begin with.", metavar="PARENT")],
    edits: Annotated[
        list[Path] | None,
        typer.Argument(help="JSON files of edits: a list of them, or one.", metavar="[EDITS]..."),
    ] = None,
    out: Annotated[Path, typer.Option("-o", "--out", help="File to write.")] = ...,  # type: ignore[assignment]
    settings: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            help="An edit by its kind, after those of files: KIND.FIELD=VALUE, for example "
            "set_simulation.duration=900; the value as JSON or text. Repeatable; fields of one "
            "kind one after another are one edit.",
            metavar="KIND.FIELD=VALUE",
        ),
    ] = None,
    workspace: WorkspaceOption = None,
    as_json: JsonOption = False,
) -> None:
    """Make a scenario of another one by a few edits; it knows its parent and its edits.

    It is a scenario as any other, to be run and tested. `odscen compare` of runs of both names the
    edits. The kinds of edits are the functions of odscen.scenario.edits.
    """
    from odscen.app import scenarios, variants
    from odscen.maps.store import Workspace

    asked = [edit for path in edits or () for edit in variants.read_edits(path)]
    asked += variants.edits_of_settings(settings or ())
    made = variants.make_variant(
        Workspace.open(workspace), parent, asked, name=scenarios.scenario_name(out)
    )
    path = scenarios.write_scenario(made, out)
    for edit in asked:
        log(edit.words)
    log(f"Wrote {path}")
    if as_json:
        words = [edit.words for edit in asked]
        print_json({"file": str(path), "parent": str(parent), "edits": words})
