"""``odscen cosim``: a scenario in SUMO, mirrored on a CARLA server."""

from __future__ import annotations

import json
from dataclasses import asdict, replace
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NoReturn

import typer

from odscen.base.errors import InputError
from odscen.base.text_files import write_text
from odscen.cli.console import (
    BehaviourCommandOption,
    BehaviourOption,
    BehaviourSettingOption,
    BehaviourTimeoutOption,
    JsonOption,
    OverwriteOption,
    WorkspaceOption,
    behaviour_door,
    log,
    print_json,
    print_table,
    progress,
)
from odscen.records.outcomes import RunStatus
from odscen.runs.reporter import Reporter

if TYPE_CHECKING:
    from collections.abc import Callable

    from odscen.carla.mirror.cosim_report import CosimReport
    from odscen.carla.mirror.foreign_actors import ForeignRoles
    from odscen.carla.native.native_run import NativeOptions
    from odscen.carla.sensors.sensor_file import SensorWish
    from odscen.carla.server.client import Address
    from odscen.runs.finished_run import Run
    from odscen.runs.reporter import Progress
    from odscen.runs.run_settings import RunSettings


# ------------------------------------------------------------------------- odscen cosim --selfcheck
def run_selfcheck(
    address: Address,
    scenario: Path | None,
    *,
    out: Path | None,
    workspace: Path | None,
    as_json: bool,
) -> NoReturn:
    """Check a server, write the page and its data, and exit.

    Raises
    ------
    WorkspaceError
        If the files cannot be written.
    """
    from odscen.carla.selfcheck.selfcheck_page import DATA, PAGE, selfcheck_data, selfcheck_page
    from odscen.carla.selfcheck.selfcheck_run import selfcheck
    from odscen.carla.server.interruption import INTERRUPTED
    from odscen.maps.store import Workspace

    with progress("checking") as step:
        report = selfcheck(Workspace.open(workspace), address, scenario=scenario, notify=step)
    folder = out or Path()
    data = selfcheck_data(report)
    write_text(folder / PAGE, selfcheck_page(report))
    write_text(folder / DATA, json.dumps(data, indent=1) + "\n")
    if as_json:
        print_json({**data, "files": {"page": str(folder / PAGE), "data": str(folder / DATA)}})
    else:
        rows = [(line.name, line.expected, line.seen, str(line.state)) for line in report.lines]
        print_table("", ("check", "expected", "seen", "result"), rows)
    log(f"Page: {folder / PAGE}")
    if report.interrupted:
        raise typer.Exit(INTERRUPTED)
    raise typer.Exit(1 if report.differing else 0)


# ----------------------------------------------------------------------------- odscen cosim
class Ego(StrEnum):
    """Who drives the ego."""

    SUMO = "sumo"
    EXTERNAL = "external"


class SignalsBy(StrEnum):
    """Who switches the traffic lights."""

    SUMO = "sumo"
    CARLA = "carla"


def cosim(
    context: typer.Context,
    scenario: Annotated[
        Path | None, typer.Argument(help="The scenario; not needed with --selfcheck.")
    ] = None,
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
        typer.Option(help="Driver of the ego: SUMO, or the owner of CARLA's role hero."),
    ] = Ego.SUMO,
    foreign: Annotated[
        str,
        typer.Option(
            help="Who else on the server SUMO's traffic sees: all, none, or roles with commas.",
            metavar="ROLES",
        ),
    ] = "all",
    signals: Annotated[
        SignalsBy,
        typer.Option(help="Whose programs the traffic lights run; the other one follows."),
    ] = SignalsBy.SUMO,
    follow: Annotated[
        bool,
        typer.Option("--follow", help="Let another client tick: go by the server's clock."),
    ] = False,
    sensor: Annotated[
        Path | None,
        typer.Option(help="File of sensors to attach to the ego; recorded into the run's folder."),
    ] = None,
    hook: Annotated[
        str | None,
        typer.Option(
            help="Function that gets the world and the actors after each tick.",
            metavar="MODULE:FUNCTION",
        ),
    ] = None,
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
    sheet: Annotated[
        int,
        typer.Option(
            min=0,
            max=100,
            help="Instants of a page in the run's folder: the plan beside what the camera saw.",
        ),
    ] = 0,
    picture_rate: Annotated[
        float, typer.Option(min=0.1, max=60, help="Pictures per simulated second.")
    ] = 10.0,
    parity: Annotated[
        bool, typer.Option("--parity/--no-parity", help="Compare both worlds, step by step.")
    ] = True,
    sensed_speed: Annotated[
        bool,
        typer.Option(
            "--sensed-speed", help="Let sensors see speeds: vehicles keep physics, without gravity."
        ),
    ] = False,
    wheel_calls: Annotated[
        int,
        typer.Option(
            min=0,
            help="Calls in a tick, at most, that turn wheels and move doors near the ego; "
            "0 for none.",
        ),
    ] = 24,
    weather: Annotated[
        bool, typer.Option("--weather/--no-weather", help="Whether weather acts on driving.")
    ] = True,
    carla_python: Annotated[
        Path | None,
        typer.Option(
            help="A Python that has odscen and carla, which carries this out.", metavar="PATH"
        ),
    ] = None,
    record_protocol: Annotated[
        Path | None,
        typer.Option(
            help="File that gets all that is said with the server, for a replay in tests; "
            "compressed if it ends in .gz.",
        ),
    ] = None,
    check: Annotated[
        bool,
        typer.Option(
            "--selfcheck",
            help="Run nothing: measure on the server what the mirror relies on, as one page.",
        ),
    ] = False,
    behaviour: BehaviourOption = None,
    behaviour_set: BehaviourSettingOption = None,
    behaviour_cmd: BehaviourCommandOption = None,
    behaviour_timeout: BehaviourTimeoutOption = 60.0,
    overwrite: OverwriteOption = False,
    workspace: WorkspaceOption = None,
    as_json: JsonOption = False,
) -> None:
    """Run a scenario in SUMO and show it, actor for actor, on a CARLA server.

    Exit code 0: completed; 1: --selfcheck found differences; 2: bad input; 3: the run or the
    server failed; 130: interrupted.
    """
    if carla_python is not None:
        from odscen.cli.other_python import carry_out_elsewhere

        code = carry_out_elsewhere(carla_python, "--carla-python", package="carla")
        raise typer.Exit(code)
    from odscen.carla.mirror.cosim import cosim as run_cosim
    from odscen.carla.mirror.cosim_options import CosimOptions
    from odscen.carla.mirror.nearby import Nearby
    from odscen.carla.mirror.tick_hook import load_hook
    from odscen.carla.native.native_run import NativeOptions
    from odscen.carla.sensors.pictures import Wish
    from odscen.carla.server.client import Address
    from odscen.carla.server.protocol_recording import recorded_protocol
    from odscen.maps.store import Workspace
    from odscen.runs.run_settings import RunSettings

    address = Address.parse(carla, timeout=timeout)
    if scenario is None and not check:
        raise InputError("no scenario is named: name its file, or ask for --selfcheck")
    if record_protocol is not None:
        address = context.with_resource(recorded_protocol(address, record_protocol))
    if check or scenario is None:
        run_selfcheck(address, scenario, out=out, workspace=workspace, as_json=as_json)
    settings = RunSettings(
        seed=seed,
        until=until,
        step_length=step_length,
        weather=weather,
        behaviour=behaviour_door(behaviour, behaviour_set, behaviour_cmd, behaviour_timeout),
    )
    options = CosimOptions(
        address=address,
        tick=tick,
        nearby=Nearby(radius, most),
        external_ego=ego is Ego.EXTERNAL,
        foreign=_foreign_roles(foreign),
        carla_signals=signals is SignalsBy.CARLA,
        follow=follow,
        load_map=load_map,
        parity=parity,
        sensed_speed=sensed_speed,
        wheel_calls=wheel_calls,
        sensors=_read_sensors(sensor),
        hook=None if hook is None else load_hook(hook),
        pictures=Wish(frames, video, sheet, picture_rate),
    )
    if native and follow:
        raise InputError(
            "--native drives with the Traffic Manager, which has to tick: leave --follow out"
        )
    if native and sheet:
        raise InputError("--native drives without a plan to look at beside it: leave --sheet out")
    if native and settings.behaviour is not None:
        raise InputError("--native drives with the Traffic Manager: leave --behaviour out")
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
            overwrite=overwrite,
            workspace=workspace,
            as_json=as_json,
        )
    with progress("mirroring") as step:
        result, report = run_cosim(
            Workspace.open(workspace),
            scenario,
            options,
            settings=settings,
            out=out,
            overwrite=overwrite,
            reporter=_BarReporter(step),
        )
    _show_result(result, report, as_json=as_json)
    raise typer.Exit(_exit_code(result, report))


def _read_sensors(file: Path | None) -> tuple[SensorWish, ...]:
    from odscen.carla.sensors.sensor_file import parse_sensors

    if file is None:
        return ()
    try:
        text = file.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(
            f"cannot be read: {getattr(error, 'strerror', None) or error}", file=str(file)
        ) from error
    return parse_sensors(text, file=str(file))


def _foreign_roles(words: str) -> ForeignRoles | None:
    from odscen.carla.mirror.foreign_actors import ForeignRoles

    if words == "none":
        return None
    names = tuple(filter(None, (name.strip() for name in words.split(","))))
    return ForeignRoles(None if names == ("all",) else names)


def _run_native(
    scenario: Path,
    options: NativeOptions,
    settings: RunSettings,
    *,
    out: Path | None,
    overwrite: bool,
    workspace: Path | None,
    as_json: bool,
) -> NoReturn:
    from odscen.carla.native.native_run import run_native
    from odscen.carla.server.interruption import INTERRUPTED
    from odscen.maps.store import Workspace

    with progress("driving in CARLA") as step:
        result, report = run_native(
            Workspace.open(workspace),
            scenario,
            options,
            settings=settings,
            out=out,
            overwrite=overwrite,
            reporter=_BarReporter(step),
        )
    if as_json:
        print_json({**result.to_dict(), "carla": asdict(report)})
    else:
        keys = ("planned", "inserted", "arrived", "running")
        counts = result.summary["actors"]
        row = (result.folder.name, result.status, *(counts[key] for key in keys))
        print_table("", ("run", "status", *keys), [row])
    if result.summary["error"]:
        log(result.summary["error"])
    if report.interrupted:
        log("Interrupted; what CARLA did so far is kept.")
    log(f"Report: {result.to_dict()['files'].get('report', result.folder)}")
    failed = result.status is RunStatus.FAILED
    raise typer.Exit(INTERRUPTED if report.interrupted and not failed else result.exit_code)


class _BarReporter(Reporter):
    """Shows how far a run is, and logs what is to be known of it."""

    def __init__(self, show: Callable[[str, float], None]) -> None:
        self._show = show

    def advanced(self, progress: Progress) -> None:
        self._show(f"{progress.time:.0f} s, {progress.running} on the road", progress.share)

    def said(self, words: str) -> None:
        log(words)


def _exit_code(result: Run, report: CosimReport) -> int:
    from odscen.carla.server.interruption import INTERRUPTED

    if result.status is RunStatus.FAILED or report.error or report.left_behind:
        return 3
    return INTERRUPTED if report.interrupted else result.exit_code


def _show_result(result: Run, report: CosimReport, *, as_json: bool) -> None:
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
    if report.pictures_dropped:
        log(
            f"{report.pictures_dropped} of {report.pictures} pictures were given up: "
            "writing them took longer than the run"
        )
    if report.signals_missing:
        missing = ", ".join(report.signals_missing)
        log(f"signals without a light in CARLA: {missing}")
    for words in dict.fromkeys((*report.warnings, report.error, result.summary["error"])):
        if words:
            log(words)
    for words in report.left_behind:
        log(words)
    if report.interrupted:
        log("Interrupted; what SUMO did so far is kept.")
    log(f"Report: {result.to_dict()['files'].get('report', result.folder)}")
