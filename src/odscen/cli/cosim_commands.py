"""``odscen cosim``: a scenario in SUMO, mirrored on a CARLA server."""

from __future__ import annotations

from dataclasses import asdict, replace
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NoReturn

import typer

from odscen.cli.console import JsonOption, WorkspaceOption, log, print_json, print_table, progress
from odscen.results.records.outcomes import RunStatus

if TYPE_CHECKING:
    from odscen.carla.cosim import CosimReport
    from odscen.carla.native_run import NativeOptions
    from odscen.sumo.folder.finished_run import Run
    from odscen.sumo.realize.run_settings import RunSettings
    from odscen.sumo.worker.protocol import Progress


class Ego(StrEnum):
    """Who drives the ego."""

    SUMO = "sumo"
    EXTERNAL = "external"


def cosim(
    scenario: Annotated[Path, typer.Argument(help="The scenario.")],
    carla: Annotated[
        str, typer.Option(help="Where the CARLA server is.", metavar="HOST:PORT")
    ] = "127.0.0.1:2000",
    out: Annotated[
        Path | None, typer.Option(help="Folder for the run. (default: the workspace's runs)")
    ] = None,
    seed: Annotated[
        int | None, typer.Option(min=0, help="Instead of the scenario's own seed.")
    ] = None,
    until: Annotated[
        float | None, typer.Option(min=0.1, help="Simulated seconds, at most.")
    ] = None,
    step_length: Annotated[
        float | None, typer.Option(min=0.01, max=1, help="Seconds per step of SUMO's.")
    ] = None,
    tick: Annotated[
        float | None,
        typer.Option(
            min=0.001,
            max=1,
            help="Seconds per tick of CARLA's. (default: a step, or parts of it up to 0.05)",
        ),
    ] = None,
    radius: Annotated[
        float | None, typer.Option(min=1, help="Show only who is this near the ego, metres.")
    ] = None,
    most: Annotated[
        int | None, typer.Option(min=1, help="Show this many road users at most.")
    ] = None,
    ego: Annotated[
        Ego,
        typer.Option(help="Driver of the ego: SUMO, or the owner of CARLA's role 'hero'."),
    ] = Ego.SUMO,
    load_map: Annotated[
        bool,
        typer.Option("--load-map/--keep-map", help="Whether CARLA may load the scenario's map."),
    ] = True,
    timeout: Annotated[
        float, typer.Option(min=0.5, help="Seconds that the server may take to answer.")
    ] = 10.0,
    native: Annotated[
        bool,
        typer.Option(
            "--native", help="Let CARLA's Traffic Manager and walkers drive, without SUMO."
        ),
    ] = False,
    physics: Annotated[
        bool,
        typer.Option("--physics/--no-physics", help="Whether vehicles have physics with --native."),
    ] = True,
    frames: Annotated[
        Path | None, typer.Option(help="Folder for pictures from above, as PNG files.")
    ] = None,
    video: Annotated[
        Path | None, typer.Option(help="Film from above: a file ending in .mp4, .mkv or .webm.")
    ] = None,
    picture_rate: Annotated[
        float, typer.Option(min=0.1, max=60, help="Pictures per simulated second.")
    ] = 10.0,
    parity: Annotated[
        bool, typer.Option("--parity/--no-parity", help="Compare both worlds, step by step.")
    ] = True,
    weather: Annotated[
        bool, typer.Option("--weather/--no-weather", help="Whether weather acts on driving.")
    ] = True,
    workspace: WorkspaceOption = None,
    as_json: JsonOption = False,
) -> None:
    """Run a scenario in SUMO and show it, actor for actor, on a CARLA server.

    Exit code 0: completed; 2: bad input; 3: the run or the server failed; 130: interrupted.
    """
    from odscen.carla.client import Address
    from odscen.carla.cosim import cosim as run_cosim
    from odscen.carla.cosim_options import CosimOptions
    from odscen.carla.native_run import NativeOptions
    from odscen.carla.nearby import Nearby
    from odscen.carla.pictures import Wish
    from odscen.sumo.realize.run_settings import RunSettings
    from odscen.workspace.store import Workspace

    settings = RunSettings(seed=seed, until=until, step_length=step_length, weather=weather)
    options = CosimOptions(
        address=Address.parse(carla, timeout=timeout),
        tick=tick,
        nearby=Nearby(radius, most),
        external_ego=ego is Ego.EXTERNAL,
        load_map=load_map,
        parity=parity,
        pictures=Wish(frames, video, picture_rate),
    )
    if native:
        _run_native(
            scenario,
            NativeOptions(
                address=options.address,
                tick=tick,
                load_map=load_map,
                physics=physics,
                pictures=options.pictures,
            ),
            # CARLA's ticks are its steps.
            replace(settings, step_length=None),
            out=out,
            workspace=workspace,
            as_json=as_json,
        )
    with progress("mirroring") as step:

        def follow(message: Progress) -> None:
            step(f"{message.time:.0f} s, {message.running} on the road", message.share)

        result, report = run_cosim(
            Workspace.open(workspace),
            scenario,
            options,
            settings=settings,
            out=out,
            progress=follow,
        )
    _show(result, report, as_json=as_json)
    raise typer.Exit(_exit_code(result, report))


def _run_native(
    scenario: Path,
    options: NativeOptions,
    settings: RunSettings,
    *,
    out: Path | None,
    workspace: Path | None,
    as_json: bool,
) -> NoReturn:
    from odscen.carla.cosim import INTERRUPTED
    from odscen.carla.native_run import run_native
    from odscen.workspace.store import Workspace

    with progress("driving in CARLA") as step:
        result, report = run_native(
            Workspace.open(workspace),
            scenario,
            options,
            settings=settings,
            out=out,
            tell=log,
            progress=lambda message: step(
                f"{message.time:.0f} s, {message.running} on the road", message.share
            ),
        )
    if as_json:
        print_json({**result.to_dict(), "carla": asdict(report)})
    else:
        keys = ("planned", "inserted", "arrived", "running")
        counts = result.summary["actors"]
        row = (result.folder.name, result.status, *(counts[key] for key in keys))
        print_table("", ("run", "status", *keys), [row])
    for words in (*report.notes, result.summary["error"]):
        if words:
            log(words)
    if report.interrupted:
        log("Interrupted; what CARLA did so far is kept.")
    log(f"Report: {result.to_dict()['files'].get('report', result.folder)}")
    failed = result.status is RunStatus.FAILED
    raise typer.Exit(INTERRUPTED if report.interrupted and not failed else result.exit_code)


def _exit_code(result: Run, report: CosimReport) -> int:
    from odscen.carla.cosim import INTERRUPTED

    if result.status is RunStatus.FAILED or report.error or report.left_behind:
        return 3
    return INTERRUPTED if report.interrupted else result.exit_code


def _show(result: Run, report: CosimReport, *, as_json: bool) -> None:
    if as_json:
        print_json({**result.to_dict(), "carla": asdict(report)})
    else:
        counts = result.summary["actors"]
        own = f"{report.own_ms[0]:.1f}" if report.own_ms else "-"
        print_table(
            "",
            ("run", "status", "planned", "inserted", "mirrored", "ticks", "own ms per tick"),
            [
                (
                    result.folder.name,
                    result.status,
                    counts["planned"],
                    counts["inserted"],
                    report.spawned,
                    report.ticks,
                    own,
                )
            ],
        )
    for refused in report.refused:
        log(f"not taken by CARLA: {refused['actor']} ({refused['tries']}x): {refused['reason']}")
    if report.signals_missing:
        missing = ", ".join(report.signals_missing)
        log(f"signals without a light in CARLA: {missing}")
    for words in (report.error, *report.left_behind, result.summary["error"]):
        if words:
            log(words)
    if report.interrupted:
        log("Interrupted; what SUMO did so far is kept.")
    log(f"Report: {result.to_dict()['files'].get('report', result.folder)}")
