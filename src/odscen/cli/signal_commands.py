"""``odscen signals``: programs of lights, shown, timed, and from and to SUMO's files."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from odscen.base.errors import InputError
from odscen.cli.console import (
    JobsOption,
    JsonOption,
    SeedsOption,
    WorkspaceOption,
    log,
    print_json,
    print_table,
    progress,
)
from odscen.cli.scenario_commands import ScenarioArgument

if TYPE_CHECKING:
    from collections.abc import Sequence

    import polars as pl

    from odscen.app.signals.signal_evaluation import SignalEvaluation
    from odscen.maps.store import Workspace
    from odscen.scenario.document.scenario_document import Scenario
    from odscen.scenario.signals.green_wave import Favoured
    from odscen.sumo.calibrate.light_timing import TimedLight

JunctionOption = Annotated[
    list[str] | None, typer.Option("--junction", help="Only this light; may be given again.")
]
OutOption = Annotated[
    Path | None,
    typer.Option("-o", "--out", help="File to write. (default: the scenario itself)"),
]

TrialOption = Annotated[
    bool,
    typer.Option(
        "--trial/--no-trial", help="Run it against what there was, with several seeds, first."
    ),
]
AnywayOption = Annotated[
    bool, typer.Option("--anyway", help="Write it also if it makes the mean delay longer.")
]

app = typer.Typer(
    help="Programs of traffic lights: what they show, and from and to SUMO's files.",
    no_args_is_help=True,
)


@app.command()
def show(
    scenario: ScenarioArgument,
    junction: JunctionOption = None,
    svg: Annotated[
        Path | None,
        typer.Option(
            "--svg",
            help="Draw stages, time bars and detectors: a file for one light, else a folder.",
        ),
    ] = None,
    workspace: WorkspaceOption = None,
    as_json: JsonOption = False,
) -> None:
    """Show signal groups, stages and plans of the lights of a scenario."""
    from odscen.app.signals.signal_plans import signal_programs
    from odscen.app.signals.signal_views import chosen_lights
    from odscen.maps.store import Workspace

    space = Workspace.open(workspace)
    lights = chosen_lights(signal_programs(space, scenario), junction or ())
    drawn = [] if svg is None else _draw_sheets(space, scenario, junction or (), svg)
    if as_json:
        more = {} if svg is None else {"svg": [str(path) for path in drawn]}
        print_json({"lights": [asdict(light) for light in lights], **more})
        return
    for light in lights:
        rows = [[group.id, ", ".join(group.movements)] for group in light.groups]
        print_table(f"Junction {', '.join(light.junctions)}", ["group", "movements"], rows)
        for plan in light.plans:
            title = f"{plan.id}: {plan.cycle:g} s, offset {plan.offset:g} s, {light.control}"
            rows = [
                [phase.name, f"{phase.seconds:g}", _green_groups(light.groups, phase.state)]
                for phase in plan.phases
            ]
            print_table(title, ["phase", "s", "green"], rows)
    for path in drawn:
        log(f"wrote {path}")


def _draw_sheets(
    workspace: Workspace, scenario: Path, junctions: Sequence[str], out: Path
) -> list[Path]:
    """Write a sheet for each light, into ``out`` if that is a folder."""
    from odscen.app.signals.signal_views import signal_sheets
    from odscen.base.text_files import write_text

    sheets = signal_sheets(workspace, scenario, junctions=junctions)
    if out.suffix.lower() == ".svg" and not out.is_dir():
        if len(sheets) > 1:
            msg = f"{out} is one file, but there are {len(sheets)} lights: name a folder, or one "
            msg += "light with --junction"
            raise typer.BadParameter(msg, param_hint="--svg")
        return [write_text(out, *sheets.values())]
    return [write_text(out / name, text) for name, text in sheets.items()]


def _write_with_notes(
    document: Scenario, notes: Sequence[str], path: Path, *, as_json: bool
) -> None:
    from odscen.app.scenarios import write_scenario

    written = write_scenario(document, path)
    for note in notes:
        log(note)
    if as_json:
        print_json({"scenario": str(written), "notes": list(notes)})
    else:
        log(f"wrote {written}")


@app.command("import")
def import_(
    scenario: ScenarioArgument,
    file: Annotated[
        Path,
        typer.Argument(help="SUMO's programs: .tll.xml, .add.xml or .net.xml.", metavar="FILE"),
    ],
    junction: JunctionOption = None,
    strict: Annotated[
        bool,
        typer.Option("--strict", help="Refuse a program that conflicts or is not one of stages."),
    ] = False,
    out: OutOption = None,
    workspace: WorkspaceOption = None,
    as_json: JsonOption = False,
) -> None:
    """Take programs over from SUMO's tlLogic, with WAUT as plans of the day, and its loops.

    A program that conflicts, whose intergreens are too short, or that stages cannot say runs as it
    is: its phases stay SUMO's own, and what was found in it is printed.
    """
    from odscen.app.signals.signal_plans import import_signals
    from odscen.maps.store import Workspace

    document, notes = import_signals(
        Workspace.open(workspace), scenario, file, junctions=junction or (), strict=strict
    )
    _write_with_notes(document, notes, out or scenario, as_json=as_json)


@app.command()
def play_log(
    scenario: ScenarioArgument,
    file: Annotated[
        Path,
        typer.Argument(help="Event log: time, device, event, parameter.", metavar="LOG"),
    ],
    junction: Annotated[str, typer.Option("--junction", help="The light.")],
    phase: Annotated[
        list[str],
        typer.Option(
            "--phase",
            help="Phase of the controller and the movements it shows green to: 2=r12, "
            "'5=r12 left', 'P2=walk r8' (walk), O1=r3 (overlap); once for each.",
            metavar="PHASE=MOVEMENT,...",
        ),
    ],
    device: Annotated[
        str | None, typer.Option("--device", help="Controller of the log. (default: the only one)")
    ] = None,
    begin: Annotated[
        str | None,
        typer.Option(
            "--begin",
            help="Time of the log at which the run begins: 12:30. (default: the scenario's time of "
            "day, or the first event)",
        ),
    ] = None,
    out: OutOption = None,
    workspace: WorkspaceOption = None,
    as_json: JsonOption = False,
) -> None:
    """Let a light show what the log of its controller says, second by second."""
    from odscen.app.signals.controller_logs import play_controller_log
    from odscen.maps.store import Workspace

    phases: dict[str, list[str]] = {}
    for given in phase:
        name, equals, movements = given.partition("=")
        if not equals:
            raise typer.BadParameter(f"{given!r} has no '='", param_hint="--phase")
        phases.setdefault(name.strip(), []).extend(m.strip() for m in movements.split(","))
    document, notes = play_controller_log(
        Workspace.open(workspace),
        scenario,
        file,
        junction=junction,
        phases=phases,
        device=device,
        begin=begin,
    )
    _write_with_notes(document, notes, out or scenario, as_json=as_json)


@app.command()
def log_measures(
    file: Annotated[
        Path,
        typer.Argument(help="Event log: time, device, event, parameter.", metavar="LOG"),
    ],
    detectors: Annotated[
        Path,
        typer.Option(
            "--detectors",
            help="Table of its detectors: device, phase, parameter, function (advance, presence).",
        ),
    ],
    minutes: Annotated[int, typer.Option("--bin", help="Minutes of a row.", min=1, max=1440)] = 15,
    out: Annotated[
        Path | None, typer.Option("-o", "--out", help="Folder for the tables, as CSV.")
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Arrivals on green, split failures and pedestrian delay of a controller's event log."""
    from odscen.app.signals.controller_logs import controller_measures
    from odscen.base.text_files import write_text

    measures = controller_measures(file, detectors, minutes=minutes)
    if as_json:
        print_json({name: _rows_as_json(table) for name, table in measures.items()})
    for name, table in measures.items():
        if not as_json and name != "arrivals":
            rows = [[_format_cell(value) for value in row] for row in table.rows()]
            print_table(name.replace("_", " "), table.columns, rows)
        if out is not None:
            log(f"wrote {write_text(out / f'{name}.csv', table.write_csv())}")


def _rows_as_json(table: pl.DataFrame) -> list[dict[str, Any]]:
    import polars.selectors as cs

    return table.with_columns(cs.datetime().dt.to_string("%Y-%m-%dT%H:%M:%S%.3f")).to_dicts()


def _format_cell(value: object) -> str:
    return f"{value:.3f}" if isinstance(value, float) else str(value)


@app.command()
def export(
    scenario: ScenarioArgument,
    out: Annotated[Path, typer.Option("-o", "--out", help="Additional file to write.")] = Path(
        "signals.add.xml"
    ),
    workspace: WorkspaceOption = None,
    as_json: JsonOption = False,
) -> None:
    """Write the programs of a scenario's lights as an additional file for SUMO."""
    from odscen.app.signals.signal_plans import export_signals
    from odscen.base.text_files import write_text
    from odscen.maps.store import Workspace

    path = write_text(out, export_signals(Workspace.open(workspace), scenario))
    if as_json:
        print_json({"file": str(path)})
    else:
        log(f"wrote {path}")


@app.command()
def webster(
    scenario: ScenarioArgument,
    junction: JunctionOption = None,
    begin: Annotated[
        float | None,
        typer.Option(help="Second of the scenario. (default: the busiest hour)", min=0.0),
    ] = None,
    end: Annotated[float | None, typer.Option(help="Second of the scenario.", min=0.0)] = None,
    saturation: Annotated[
        float, typer.Option(help="Saturation flow of a lane that goes straight, vehicles an hour.")
    ] = 1900.0,
    shortest: Annotated[float, typer.Option(help="Shortest cycle, seconds.")] = 40.0,
    longest: Annotated[float, typer.Option(help="Longest cycle, seconds.")] = 120.0,
    turn_arrows: Annotated[
        bool,
        typer.Option(
            help="Give turns across oncoming traffic a protected stage beside their permissive one "
            "where the volumes ask for it."
        ),
    ] = False,
    trial: TrialOption = True,
    seeds: SeedsOption = None,
    jobs: JobsOption = 1,
    anyway: AnywayOption = False,
    out: OutOption = None,
    workspace: WorkspaceOption = None,
    as_json: JsonOption = False,
) -> None:
    """Time lights after the demand: cycle and splits by Webster's method."""
    from odscen.app import scenarios
    from odscen.app.signals.signal_optimisation import time_signals
    from odscen.app.signals.turn_arrows import arrow_words, with_turn_arrows
    from odscen.maps.store import Workspace

    store = Workspace.open(workspace)
    given, arrows = (
        with_turn_arrows(store, scenario, junctions=junction or (), begin=begin, end=end)
        if turn_arrows
        else (scenario, ())
    )
    timed = time_signals(
        store,
        given,
        junctions=junction or (),
        begin=begin,
        end=end,
        saturation=saturation,
        bounds=(shortest, longest),
    )
    tried = (
        _evaluate_sides(store, timed.scenario, today=scenario, seeds=seeds, jobs=jobs)
        if trial
        else None
    )
    _refuse_worse(tried, anyway=anyway)
    path = scenarios.write_scenario(timed.scenario, out or scenario)
    if as_json:
        found = {"arrows": [arrow._asdict() for arrow in arrows]} if turn_arrows else {}
        more = {} if tried is None else {"evaluation": tried.to_dict()}
        print_json({"scenario": str(path), **timed.to_dict(), **found, **more})
        return
    for words in arrow_words(arrows) if turn_arrows else ():
        log(words)
    for light in timed.lights:
        print_timed_light(light)
    for name in timed.without:
        log(f"junction {name}: no vehicle comes to its light, which keeps its times")
    for name in timed.oversaturated:
        log(f"junction {name} is oversaturated: more vehicles come than its greens carry")
    if tried is not None:
        log(tried.words)
    log(f"demand of {timed.begin:g} to {timed.end:g} s; wrote {path}")


@app.command()
def coordinate(
    scenario: ScenarioArgument,
    along: Annotated[
        str | None,
        typer.Option(help="Roads of the corridor: ids, segments or names, with commas between."),
    ] = None,
    junctions: Annotated[
        str | None, typer.Option(help="Or its junctions in driving order, with commas between.")
    ] = None,
    direction: Annotated[
        str, typer.Option(help="Whose band is to be the widest: both, out or back.")
    ] = "both",
    speed: Annotated[
        float | None, typer.Option(help="Progression speed, km/h. (default: the speed limits)")
    ] = None,
    cycle: Annotated[
        float | None, typer.Option(help="Seconds. (default: the longest of the lights)", min=1.0)
    ] = None,
    svg: Annotated[
        Path | None, typer.Option("--svg", help="Write the time-space diagram here.")
    ] = None,
    trial: TrialOption = True,
    seeds: SeedsOption = None,
    jobs: JobsOption = 1,
    anyway: AnywayOption = False,
    out: OutOption = None,
    workspace: WorkspaceOption = None,
    as_json: JsonOption = False,
) -> None:
    """Coordinate lights along a corridor: one cycle, and the offsets with the widest bands."""
    from odscen.app import scenarios
    from odscen.app.signals.green_waves import coordinate_signals
    from odscen.base.text_files import write_text
    from odscen.maps.store import Workspace

    store = Workspace.open(workspace)
    coordination = coordinate_signals(
        store,
        scenario,
        junctions=_split_list(junctions),
        along=_split_list(along),
        favoured=_parse_direction(direction),
        speed=None if speed is None else speed / 3.6,
        cycle=cycle,
    )
    if not (coordination.worth_it or anyway):
        raise InputError(
            f"{' '.join(coordination.doubts)} With --anyway it is written all the same"
        )
    tried = (
        _evaluate_sides(store, coordination.scenario, today=scenario, seeds=seeds, jobs=jobs)
        if trial
        else None
    )
    _refuse_worse(tried, anyway=anyway)
    path = scenarios.write_scenario(coordination.scenario, out or scenario)
    if svg is not None:
        write_text(svg, coordination.to_svg())
    if as_json:
        drawn = {} if svg is None else {"svg": str(svg)}
        more = {} if tried is None else {"evaluation": tried.to_dict()}
        print_json({"scenario": str(path), **drawn, **coordination.to_dict(), **more})
        return
    rows = [
        (", ".join(light.junctions), round(light.metres), light.offset, light.wave.out_time)
        for light in coordination.lights
    ]
    print_table(f"Cycle {coordination.cycle:g} s", ["junction", "m", "offset, s", "drive, s"], rows)
    for name, band, before in zip(
        ("out", "back"), (coordination.out, coordination.back), coordination.before, strict=True
    ):
        share = 100.0 * band.seconds / coordination.cycle
        log(f"band {name}: {band.seconds:.1f} s, {share:.0f} % of the cycle (was {before:.1f} s)")
    for words in coordination.doubts:
        log(words)
    if tried is not None:
        log(tried.words)
    log(f"wrote {path}" + ("" if svg is None else f" and {svg}"))


@app.command()
def evaluate(
    scenario: ScenarioArgument,
    today: Annotated[
        Path | None,
        typer.Option(
            help="Scenario whose programs are those of today. (default: the map's own programs)"
        ),
    ] = None,
    seeds: SeedsOption = None,
    jobs: JobsOption = 1,
    workspace: WorkspaceOption = None,
    as_json: JsonOption = False,
) -> None:
    """Run the programs of a scenario against those of today, in pairs of one seed.

    Demand, closures and everything else are those of the scenario on both sides. The mean delay
    of all road users decides, waits outside included, with its 95 % interval.
    """
    from odscen.maps.store import Workspace

    comparison = _evaluate_sides(
        Workspace.open(workspace), scenario, today=today, seeds=seeds, jobs=jobs
    )
    if as_json:
        print_json(comparison.to_dict())
        return
    rows = [
        (
            name,
            *("-" if value is None else f"{value:,.2f}" for value in (difference.a, difference.b)),
            "-" if difference.low is None else f"{difference.low:+,.2f} to {difference.high:+,.2f}",
            difference.finding.value,
        )
        for name, difference in comparison.differences.items()
    ]
    print_table("", ["figure", "today", "evaluated", "difference, 95 %", "finding"], rows)
    log(comparison.words)


def _evaluate_sides(
    store: Workspace, scenario: Scenario | Path, *, today: Path | None, seeds: Any, jobs: int
) -> SignalEvaluation:
    """Run both sides, with a bar."""
    from odscen.app.signals.signal_evaluation import SEEDS, evaluate_signals
    from odscen.cli.run_commands import BarReporter

    chosen = SEEDS if seeds is None else seeds
    with progress("running") as step:
        return evaluate_signals(
            store, scenario, today=today, seeds=chosen, processes=jobs,
            reporter=BarReporter(step, 2 * len(chosen)),
        )  # fmt: skip


def _refuse_worse(tried: SignalEvaluation | None, *, anyway: bool) -> None:
    """Refuse what makes the mean delay longer.

    Raises
    ------
    InputError
        With what the runs say.
    """
    if tried is not None and tried.worse and not anyway:
        raise InputError(f"{tried.words} Nothing was written; with --anyway it is")


def _split_list(text: str | None) -> tuple[str, ...]:
    return tuple(part.strip() for part in (text or "").split(",") if part.strip())


def _parse_direction(text: str) -> Favoured:
    known: dict[str, Favoured] = {"both": "both", "out": "out", "back": "back"}
    if text not in known:
        raise typer.BadParameter(f"{text!r} is not both, out or back", param_hint="--direction")
    return known[text]


def print_timed_light(light: TimedLight) -> None:
    """Write the tables of a light that was timed."""
    splits, before = light.splits, light.before
    title = (
        f"Junction {', '.join(light.times.junctions)}: cycle {light.times.cycle:g} s "
        f"(was {before.cycle:g} s), lost time {splits.lost:g} s, flow ratio {splits.flow_ratio:.2f}"
    )
    rows = list(
        zip(light.times.stages, before.green, light.times.green, splits.ratios, strict=True)
    )
    print_table(title, ["stage", "green before, s", "green, s", "flow ratio"], rows)
    moved = [
        (movement.movement, movement.turn, round(movement.vehicles)) for movement in light.movements
    ]
    print_table("", ["movement", "turn", "vehicles/h"], moved)
    lanes = [
        (
            lane.load.lane,
            ", ".join(lane.load.turns),
            round(lane.load.volume),
            round(lane.load.saturation),
            lane.load.ratio,
            lane.green,
            lane.degree,
        )
        for lane in light.lanes
    ]
    columns = ["lane", "turns", "vehicles/h", "saturation flow", "flow ratio", "green, s", "v/c"]
    print_table("", columns, lanes)


def _green_groups(groups: tuple[object, ...], state: str) -> str:
    shown = []
    for group in groups:
        letters = {state[n] for n in getattr(group, "links", ())}
        if letters & {"G", "g"}:
            shown.append(str(getattr(group, "id", "")))
    return " ".join(shown)
