"""``odscen run``: scenarios in SUMO, or in another simulator."""

from __future__ import annotations

import gc
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, cast

import typer

from odscen.base.durations import clock, parse_duration
from odscen.base.errors import InputError
from odscen.base.shown import visible
from odscen.cli.console import (
    BehaviourCommandOption,
    BehaviourOption,
    BehaviourSettingOption,
    BehaviourTimeoutOption,
    IntervalOption,
    JobsOption,
    JsonOption,
    OverwriteOption,
    SeedsOption,
    SimulatorOption,
    SimulatorSettingOption,
    WarmUpOption,
    WorkspaceOption,
    behaviour_door,
    duration,
    log,
    option_settings,
    print_json,
    print_table,
    progress,
)
from odscen.records.outcomes import RunStatus
from odscen.runs.reporter import Reporter

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from odscen.maps.store import Workspace
    from odscen.runs.finished_run import Run
    from odscen.runs.reporter import Progress
    from odscen.runs.run_settings import RunSettings, SliceLength
    from odscen.scenario.document.scenario_document import AfterStory
    from odscen.scenario.sampling.sampler import Redraw


def _read_after_story(text: str | None) -> AfterStory | None:
    """Read ``auto``, ``never`` or a duration."""
    words: dict[str | None, AfterStory | None] = {
        None: None, "auto": "auto", "never": "never", "0": 0.0,
    }  # fmt: skip
    return words[text] if text in words else duration(text or "")


@contextmanager
def _hint_at_resuming(folder: Path) -> Iterator[None]:
    """Say how to resume long runs when they are interrupted."""
    from odscen.sumo.runner.long_runs import interrupted

    before = set(interrupted(folder))
    try:
        yield
    except KeyboardInterrupt:
        for name in sorted(set(interrupted(folder)) - before):
            log(f"{name} is interrupted; to resume it: odscen resume {folder / name}")
        raise


def run(
    scenarios: Annotated[
        list[Path],
        typer.Argument(help="Scenarios, or folders of them.", metavar="SCENARIO..."),
    ],
    out: Annotated[
        Path | None, typer.Option(help="Folder for the runs. (default: the workspace's runs)")
    ] = None,
    seed: Annotated[
        int | None, typer.Option(min=0, help="Instead of the scenario's own seed.")
    ] = None,
    seeds: SeedsOption = None,
    redraw: Annotated[
        str,
        typer.Option(
            help="What a seed draws: open, what the scenario leaves open; drivers, also later "
            "departures, desired speeds and styles of placed actors; traffic, also their goals.",
            metavar="[open|drivers|traffic]",
        ),
    ] = "open",
    until: Annotated[
        float | None,
        typer.Option(
            parser=duration, metavar="TIME", help="Simulated time, at most: 600, 90min, 24h."
        ),
    ] = None,
    step_length: Annotated[
        float | None, typer.Option(min=0.01, max=1, help="Seconds per step.")
    ] = None,
    after_story: Annotated[
        str | None,
        typer.Option(
            help="How long a run continues once its story has ended: seconds, never (to its "
            "duration) or auto (10 s in a scene without traffic). (default: the scenario's own)",
            metavar="[SECONDS|auto|never]",
        ),
    ] = None,
    expect: Annotated[
        list[str] | None,
        typer.Option(help='Expectation, for example "arrived>=0.95"; repeatable.'),
    ] = None,
    jobs: JobsOption = 1,
    time_limit: Annotated[
        float | None, typer.Option(min=1, help="Wall seconds after which a run has failed.")
    ] = None,
    weather: Annotated[
        bool, typer.Option("--weather/--no-weather", help="Whether weather acts on driving.")
    ] = True,
    trajectories: Annotated[
        str | None,
        typer.Option(
            help="What of the trajectories is recorded: none, or every=TIME, "
            "region=XMIN:YMIN:XMAX:YMAX and columns=lane+pos+slope, with commas between.",
            metavar="WHAT",
        ),
    ] = None,
    emissions: Annotated[
        bool,
        typer.Option(
            "--emissions/--no-emissions",
            help="Whether fuel, CO2 and pollutants are recorded for each lane; a run takes about a "
            "fifth longer.",
        ),
    ] = True,
    criticality: Annotated[
        bool,
        typer.Option(
            "--criticality",
            help="Measure how close road users come: time to collision, post-encroachment time, "
            "braking needed. Takes twice as long; by itself where an expectation asks for it.",
        ),
    ] = False,
    slice_: Annotated[
        str,
        typer.Option(
            "--slice",
            metavar="TIME",
            help="A longer run goes in slices of this length and can be resumed; auto: 1h, from 6h "
            "on a sixth of the run, at most 4h; none: never.",
        ),
    ] = "auto",
    meso: Annotated[
        bool,
        typer.Option(
            "--meso",
            help="For scale: queues on road sections instead of single vehicles; see docs/runs.md "
            "for what this leaves out.",
        ),
    ] = False,
    warm_up: WarmUpOption = None,
    interval: IntervalOption = None,
    behaviour: BehaviourOption = None,
    behaviour_set: BehaviourSettingOption = None,
    behaviour_cmd: BehaviourCommandOption = None,
    behaviour_timeout: BehaviourTimeoutOption = 60.0,
    simulator: SimulatorOption = "sumo",
    simulator_set: SimulatorSettingOption = None,
    esmini: Annotated[
        Path | None,
        typer.Option(
            help="Play the scenario in this program of esmini: as --simulator esmini with its "
            "program.",
            metavar="PROGRAM",
        ),
    ] = None,
    reports: Annotated[
        bool | None,
        typer.Option(
            "--report/--no-report",
            help="Whether each run gets its figures and its report, which take longer than a short "
            "run itself, at once; otherwise when it is opened, from the same records. "
            "(default: a single run does)",
        ),
    ] = None,
    until_confident: Annotated[
        str | None,
        typer.Option(
            metavar="SHARE",
            help='Take more seeds until the 95 % interval of a figure is so narrow: "5 %" of its '
            "mean to either side. Exit code 1 if --most-seeds are too few.",
        ),
    ] = None,
    confident_of: Annotated[
        str, typer.Option(metavar="FIGURE", help="The figure of --until-confident.")
    ] = "mean_delay",
    most_seeds: Annotated[
        int, typer.Option(min=2, help="Seeds of --until-confident, at most.")
    ] = 50,
    overwrite: OverwriteOption = False,
    workspace: WorkspaceOption = None,
    as_json: JsonOption = False,
) -> None:
    """Run scenarios in SUMO, without a window; write records and events, figures and a report.

    The first line of each run says whether its figures can be used; --expect usable fails one
    that is not, --expect criteria one that misses a criterion of its scenario. Exit code 0:
    completed; 1: completed, but an expectation failed; 2: bad input, or the folder is in the hands
    of another process; 3: a run failed, or the machine lacks room, memory or handles.
    """
    simulator_set = simulator_set or []
    if esmini is not None:
        if simulator not in ("sumo", "esmini"):
            raise typer.BadParameter(
                f"the program of esmini is not that of {simulator}", param_hint="--esmini"
            )
        simulator, simulator_set = "esmini", [*simulator_set, f"program={esmini}"]
    if simulator == "sumo":
        from odscen.sumo.runner.forked_worker import get_ready

        get_ready()  # its imports take as long as ours, and are done meanwhile
    gc.disable()  # what is imported stays, and need not be gone through again and again
    from odscen.app.running import batches
    from odscen.app.scenarios import scenario_files
    from odscen.figures.judging.expectations import parse_expectation
    from odscen.maps.store import Workspace
    from odscen.runs.recording import Recording, parse_recording
    from odscen.runs.run_settings import RunSettings

    gc.freeze()
    gc.enable()
    recording = Recording() if trajectories is None else parse_recording(trajectories)
    slice_length: SliceLength = "auto" if slice_ == "auto" else None
    if slice_ not in ("auto", "none"):
        slice_length = parse_duration(slice_)
    if seeds is not None and seed is not None:
        raise typer.BadParameter("give --seed or --seeds, not both", param_hint="--seeds")
    settings = RunSettings(
        seed=seed,
        redraw=cast("Redraw", redraw),  # which refuses what is none
        until=until,
        step_length=step_length,
        weather=weather,
        recording=replace(recording, emissions=emissions, criticality=criticality),
        meso=meso,
        slice_length=slice_length,
        time_limit=time_limit,
        expectations=tuple(parse_expectation(text) for text in expect or ()),
        warm_up=warm_up,
        interval=interval,
        behaviour=behaviour_door(behaviour, behaviour_set, behaviour_cmd, behaviour_timeout),
        after_story=_read_after_story(after_story),
        simulator=simulator,
        simulator_options=option_settings(simulator_set, element="--simulator-set"),
    )
    paths = scenario_files(scenarios)
    store = Workspace.open(workspace)
    if reports is None:
        reports = until_confident is None and len(paths) * len(seeds or (None,)) == 1
    if until_confident is not None:
        if seed is not None:
            raise typer.BadParameter("it takes several seeds, not --seed", param_hint="--seed")
        _run_until_confident(
            store, paths, settings=settings, seeds=seeds, out=out, processes=jobs,
            share=until_confident, figure=confident_of, most=most_seeds, reports=reports,
            overwrite=overwrite, as_json=as_json,
        )  # fmt: skip
        return
    with _hint_at_resuming(out or store.runs), progress("running") as step:
        results = batches.run_many(
            store,
            paths,
            settings=settings,
            seeds=seeds,
            out=out,
            overwrite=overwrite,
            processes=jobs,
            reports=reports,
            figures=reports or as_json,
            reporter=BarReporter(step, len(paths) * len(seeds or (None,))),
        )
    show_results(results, as_json=as_json, several=len(results) > 1 or scenarios[0].is_dir())
    if seeds is not None:
        _warn_of_seeds(results, len(seeds))
    raise typer.Exit(max(result.exit_code for result in results))


def _run_until_confident(
    store: Workspace,
    paths: Sequence[Path],
    *,
    settings: RunSettings,
    seeds: Sequence[int] | None,
    out: Path | None,
    processes: int,
    share: str,
    figure: str,
    most: int,
    reports: bool,
    overwrite: bool,
    as_json: bool,
) -> None:
    """Run each scenario with as many seeds as its interval needs, and print all of it."""
    from odscen.app.running.confident_runs import FEWEST, parse_share, run_until_confident

    wanted = parse_share(share)
    results: list[Run] = []
    intervals = []
    for path in paths:
        runs, found = run_until_confident(
            store, path, share=wanted, figure=figure, most=most, settings=settings, out=out,
            overwrite=overwrite, processes=processes, reports=reports, reporter=BarReporter(),
            seeds=tuple(range(1, FEWEST + 1)) if seeds is None else seeds,
        )  # fmt: skip
        results += runs
        intervals.append(found)
    if as_json:
        print_json(
            {
                "runs": [run.to_dict() for run in results],
                "confidence": [found.to_dict() for found in intervals],
            }
        )
    else:
        show_results(results, as_json=False, several=True)
        for found in intervals:
            typer.echo(visible(f"{found.scenario}: {found.words}"))
    code = max(result.exit_code for result in results)
    raise typer.Exit(max(code, 0 if all(found.enough for found in intervals) else 1))


def _warn_of_seeds(results: Sequence[Run], seeds: int) -> None:
    """Say of which scenario the seeds hardly vary; runs of one scenario follow each other."""
    from odscen.experiments.tolerance import VARYING, hardly_varying
    from odscen.figures.measures.registry import run_figure

    figure = run_figure(VARYING)
    if figure is None:
        return
    for first in range(0, len(results), seeds):
        runs = [run for run in results[first : first + seeds] if run.status is RunStatus.COMPLETED]
        words = hardly_varying([run.value_of(figure) for run in runs])
        if words is not None:
            log(f"{runs[0].known['scenario']}: {words}")


def resume(
    run: Annotated[Path, typer.Argument(help="An interrupted run: its folder, or its name.")],
    time_limit: Annotated[
        float | None, typer.Option(min=1, help="Wall seconds after which it is interrupted again.")
    ] = None,
    behaviour: BehaviourOption = None,
    behaviour_set: BehaviourSettingOption = None,
    behaviour_cmd: BehaviourCommandOption = None,
    behaviour_socket: Annotated[
        str | None,
        typer.Option(
            metavar="PATH",
            help="The socket of the program that drives, of a run that was begun in Python.",
        ),
    ] = None,
    workspace: WorkspaceOption = None,
    as_json: JsonOption = False,
) -> None:
    """Resume an interrupted long run; it ends as if it had not been interrupted.

    A run that is driven by a program, a socket, a module or a file resumes when that is named
    again: what a folder says is never executed by itself. Exit codes as of ``run``.
    """
    from odscen.app.running import resumed_runs
    from odscen.learning.behaviour.behaviour_model import BehaviourDoor
    from odscen.maps.store import Workspace

    driven = behaviour_door(behaviour, behaviour_set, behaviour_cmd, 60.0)
    if behaviour_socket is not None:
        if driven is not None:
            raise InputError("give --behaviour, --behaviour-cmd or --behaviour-socket, one of them")
        driven = BehaviourDoor(socket=behaviour_socket)

    with progress("resuming") as step:
        result = resumed_runs.resume(
            Workspace.open(workspace),
            run,
            time_limit=time_limit,
            reporter=BarReporter(step).of_run(run.name),
            behaviour=driven,
        )
    show_results([result], as_json=as_json, several=False)
    raise typer.Exit(result.exit_code)


def show_results(results: Sequence[Run], *, as_json: bool, several: bool) -> None:
    """Print finished runs: a table for people, JSON for scripts."""
    from odscen.figures.measures.usability import UsabilityLevel

    if as_json:
        runs = [result.to_dict() for result in results]
        print_json({"runs": runs} if several else runs[0])
    else:
        for result in results:
            if result.usability:
                typer.echo(visible(f"{result.folder.name}: {result.usability['headline']}"))
        keys = ("planned", "inserted", "arrived", "teleported", "collided")
        rows = []
        for result in results:
            counts = result.known["actors"]
            verdict = result.status if result.expectations_met else "expectation failed"
            level = result.usability.get("level")
            if result.status is RunStatus.COMPLETED and level != UsabilityLevel.USABLE:
                verdict = f"{verdict}, {level or 'not judged'}"
            rows.append((result.folder.name, verdict, *(counts[key] for key in keys)))
        print_table("", ("run", "status", *keys), rows)
    for result in results:
        _say_verdicts(result)
        if result.status is RunStatus.FAILED:
            log(f"{result.folder.name}: {result.known['error']}")
        elif result.report is not None:
            log(f"Report: {result.report}")
        else:
            log(f"Records: {result.folder}; its report: odscen report {result.folder}")


def _say_verdicts(result: Run) -> None:
    """Say of each criterion whether it is met, and which expectations are not."""
    from odscen.figures.judging.criteria import missed_words
    from odscen.figures.judging.expectations import CRITERIA, USABLE

    for row in result.known.get("criteria") or ():
        met = f"met: {row['words']}" if row["passed"] else f"not met: {missed_words(row)}"
        log(visible(f"{result.folder.name}: {met}"))
    for verdict in result.known["expectations"]:
        if verdict["passed"] or verdict["expectation"] == CRITERIA.text:
            continue
        own = result.usability.get("headline") if verdict["expectation"] == USABLE.text else None
        has = f"{verdict['expectation']} (is {own or verdict['value']})"
        log(f"{result.folder.name}: failed: {has}")


class BarReporter(Reporter):
    """Shows runs that go on at the same time as one bar; what they say is logged.

    ``show`` gets words and the share done of ``total`` runs.
    """

    def __init__(self, show: Callable[[str, float], None] | None = None, total: int = 1) -> None:
        self._show, self._total = show, total
        self._shares: dict[str, float] = {}
        self._name = ""

    def of_run(self, name: str) -> Reporter:
        own = BarReporter(self._show, self._total)
        own._shares, own._name = self._shares, name
        return own

    def advanced(self, progress: Progress) -> None:
        if self._show is None:
            return
        self._shares[self._name] = progress.time / progress.until if progress.until else 0.0
        line = f"{self._name}: {progress.time:,.0f} s, {progress.running:,} on the road"
        if progress.time_left is not None:
            line = f"{line}, about {clock(progress.time_left + 59)} h left"
        self._show(line, sum(self._shares.values()) / self._total)

    def said(self, words: str) -> None:
        log(words)
