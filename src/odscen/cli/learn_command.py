"""``odscen learn``: traffic to learn from, the reference generator, and how good traffic is."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from odscen.base.errors import InputError
from odscen.cli.console import JsonOption, WorkspaceOption, log, print_json, print_table, progress

if TYPE_CHECKING:
    from odscen.app.learned.evaluation import TrafficQuality
    from odscen.app.learned.snapshot_data import MadeShard
    from odscen.formats.tracks.recorded_traffic import RecordedTraffic

DataOption = Annotated[
    Path, typer.Option("--data", help="Folder of: odscen learn data.", metavar="DIR")
]
RecordingOption = Annotated[
    list[Path] | None,
    typer.Option(
        "--recording",
        help="Recorded traffic in place of runs, on the one --map; repeatable.",
        metavar="FILE",
    ),
]
OffsetOption = Annotated[
    str,
    typer.Option(help="Of recordings: metres and degrees to the map.", metavar="X,Y[,DEGREES]"),
]
_COLUMNS = (
    "frechet", "mmd", "jsd_gap", "jsd_speed", "jsd_junction", "jsd_heading", "stopped",
    "hard_braking", "collided", "off_road", "novelty",
)  # fmt: skip

app = typer.Typer(
    help="Learn traffic from SUMO: snapshots, training, and metrics of generated traffic.",
    no_args_is_help=True,
)


@app.command()
def data(
    out: Annotated[Path, typer.Option("-o", "--out", help="Folder to write to.", metavar="DIR")],
    maps: Annotated[
        list[str] | None, typer.Option("--map", help="Only this map; may be given again.")
    ] = None,
    runs: Annotated[int, typer.Option(min=1, help="Of each map.")] = 8,
    seed: Annotated[int, typer.Option(min=0, help="Of the first run.")] = 1,
    until: Annotated[float, typer.Option(help="Seconds of each run.")] = 300.0,
    recording: RecordingOption = None,
    offset: OffsetOption = "",
    workspace: WorkspaceOption = None,
    as_json: JsonOption = False,
) -> None:
    """Run traffic on maps and store snapshots of it, a file for each run; or of recorded traffic.

    Runs that gridlock are made again with half the traffic, and in the end left out. Called again,
    it resumes after an interruption.
    """
    from odscen.app.learned.snapshot_data import DataSettings, make_shards
    from odscen.maps.store import Workspace

    settings = DataSettings(runs=runs, seed=seed, duration=until, warm_up=0.4 * until)

    def done(made: MadeShard) -> None:
        log(f"{made.file.name}: {made.skipped or f'{made.vehicles} vehicles'}")

    store = Workspace.open(workspace)
    if recording:
        from odscen.app.learned.recorded_data import make_recorded_shard

        (on_map,) = _require_one_map(maps)
        made = []
        for name, tracks in _read_recordings(recording, offset).items():
            made.append(
                make_recorded_shard(store, on_map, tracks, out, name=name, settings=settings)
            )
            done(made[-1])
    else:
        made = make_shards(store, maps or [], out, settings=settings, done=done)
    kept = [shard for shard in made if shard.skipped is None]
    log(f"{len(kept)} of {len(made)} runs kept, {sum(shard.vehicles for shard in kept)} vehicles")
    if as_json:
        rows = [shard._asdict() | {"file": str(shard.file)} for shard in made]
        print_json({"runs": rows})


@app.command()
def train(
    data: DataOption,
    out: Annotated[Path, typer.Option("-o", "--out", help="File to write.", metavar="FILE")],
    hold_out: Annotated[
        list[str] | None,
        typer.Option(help="Town to leave out, as in Town04; may be given again.", metavar="TOWN"),
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="Random seed.")] = 0,
    workspace: WorkspaceOption = None,
    as_json: JsonOption = False,
) -> None:
    """Train a model of traffic on snapshots; one thread, without a graphics card."""
    from odscen.app.learned.model_files import train as trained
    from odscen.learning.reference.model_training import TrainingSettings
    from odscen.maps.store import Workspace

    model = trained(
        Workspace.open(workspace),
        data,
        out,
        hold_out=hold_out or (),
        settings=TrainingSettings(seed=seed),
        told=log,
    )
    log(f"wrote {out}: {out.stat().st_size:,} bytes")
    if as_json:
        print_json({"file": str(out), "about": model.about})


@app.command()
def evaluate(
    data: DataOption,
    folder: Annotated[
        Path | None,
        typer.Argument(help="Scenarios to measure. (default: a model)", metavar="[FOLDER]"),
    ] = None,
    model: Annotated[
        Path | None,
        typer.Option(help="Model of: odscen learn train. (default: the one that ships)"),
    ] = None,
    towns: Annotated[
        list[str] | None, typer.Option("--town", help="Only this town; may be given again.")
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="Random seed.")] = 0,
    run: Annotated[
        bool, typer.Option("--run/--no-run", help="Run two seconds, to see who brakes hard.")
    ] = True,
    workspace: WorkspaceOption = None,
    as_json: JsonOption = False,
) -> None:
    """Compare generated traffic with SUMO's: a model beside baselines, or a folder of scenarios.

    The docs page "Learned traffic" explains the columns; values in brackets are 90 % intervals.
    """
    from odscen.app.learned import evaluation, model_files, snapshot_data
    from odscen.maps.store import Workspace

    store, shards = Workspace.open(workspace), snapshot_data.read_shards(data)
    chosen = shards
    if towns:
        others = model_files.kept(shards, towns)
        chosen = [shard for shard in shards if shard not in others]
    if folder is not None:
        found = evaluation.evaluate_scenarios(store, folder, chosen, run=run)
    else:
        with progress("evaluating") as step:
            found = evaluation.evaluate_model(
                store,
                chosen,
                shards,
                model=None if model is None else model_files.read_model(model),
                seed=seed,
                run=run,
                told=lambda what: step(what, 0.0),
            )
    if as_json:
        print_json({"maps": [quality.to_dict() for quality in found]})
        return
    for name in dict.fromkeys(quality.map_name for quality in found):
        own = [quality for quality in found if quality.map_name == name]
        title = f"{name}: {own[0].vehicles:.0f} vehicles in {own[0].scenes} snapshots"
        print_table(title, ["", *(quality.source for quality in own)], _quality_rows(own))


@app.command()
def driver(
    out: Annotated[
        Path, typer.Option("-o", "--out", help="File of weights to write.", metavar="FILE")
    ],
    maps: Annotated[
        list[str] | None, typer.Option("--map", help="Only this map; may be given again.")
    ] = None,
    hold_out: Annotated[
        list[str] | None,
        typer.Option(help="Town to measure on only, as in Town04; repeatable.", metavar="TOWN"),
    ] = None,
    runs: Annotated[int, typer.Option(min=1, help="Of each map.")] = 3,
    until: Annotated[float, typer.Option(help="Seconds of each run.")] = 200.0,
    seed: Annotated[int, typer.Option(min=0, help="Random seed.")] = 0,
    recording: RecordingOption = None,
    offset: OffsetOption = "",
    workspace: WorkspaceOption = None,
    as_json: JsonOption = False,
) -> None:
    """Learn from SUMO's drivers, or recorded ones, how to accelerate: weights of imitation.

    Of recordings the first 70 % of the time are learned from, and the error is that of the rest.
    """
    from odscen.app.learned.learned_driving import learn_driving
    from odscen.maps.store import Workspace

    store = Workspace.open(workspace)
    names = maps or [entry.name for entry in store.maps()]
    recordings = _read_recordings(recording, offset) if recording else None
    if recordings:
        names = _require_one_map(maps)
    found = learn_driving(
        store, names, out, hold_out=hold_out or (), runs=runs, duration=until, seed=seed,
        recordings=recordings, told=log,
    )  # fmt: skip
    log(f"wrote {out}: {out.stat().st_size:,} bytes")
    if as_json:
        print_json({"file": str(out), "maps": [score._asdict() for score in found]})
        return
    rows = [
        (score.map_name, score.rows, f"{score.learned:.3f}", f"{score.constant:.3f}")
        for score in found
    ]
    columns = ("map", "accelerations", "off by, m/s2", "if speeds were kept")
    print_table("root mean square error", columns, rows)


def _require_one_map(maps: list[str] | None) -> list[str]:
    if len(maps or []) != 1:
        raise InputError("name the map that the recordings lie on, once", element="--map")
    return list(maps or [])


def _read_recordings(files: list[Path], offset: str) -> dict[str, RecordedTraffic]:
    from odscen.app.exchange.recorded_traffic import read_recorded_traffic
    from odscen.maps.folder_names import name_from_file

    recordings_by_name: dict[str, RecordedTraffic] = {}
    for file in files:
        name = name_from_file(file)
        if name in recordings_by_name:
            raise InputError(f"two recordings are called {name!r}", element="--recording")
        recordings_by_name[name] = read_recorded_traffic(file, offset=offset)
    return recordings_by_name


def _quality_rows(found: list[TrafficQuality]) -> list[list[str]]:
    return [
        [column.replace("_", " "), *(_quality_cell(quality, column) for quality in found)]
        for column in _COLUMNS
        if any(column in quality.values for quality in found)
    ]


def _quality_cell(quality: TrafficQuality, column: str) -> str:
    measured = quality.values.get(column)
    if measured is None or math.isnan(measured.value):
        return ""
    text = f"{measured.value:.3f}"
    return text if math.isnan(measured.low) else f"{text} [{measured.low:.3f}, {measured.high:.3f}]"
