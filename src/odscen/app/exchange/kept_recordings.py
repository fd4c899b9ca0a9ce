"""Recordings kept in the workspace: read once, placed on a map, ready to be looked at by time.

Files that were sent are read by a child process. What is kept of them are the tracks, not the
files; a scenario of a part is made of these.
"""

from __future__ import annotations

import json
import os
import re
import shutil
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import count
from math import degrees
from pathlib import Path, PurePosixPath
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import polars as pl

from odscen.app.exchange.imports import DiskFile, maps_for_import
from odscen.app.exchange.recorded_traffic import draw_tracks_on_map
from odscen.app.maps import load_map
from odscen.base.atomic_folders import discard, new_folder
from odscen.base.checksums import (
    SUMS_FILE,
    check_files,
    digest,
    read_checked,
    read_sums,
    sums_of,
    write_sums,
)
from odscen.base.errors import ConflictError, InputError, LimitError, NotFoundError
from odscen.base.folder_locks import locked
from odscen.base.shown import printable, some_of
from odscen.base.system_errors import disk_errors
from odscen.formats.base import VERDICTS, ElementReport, ImportMap
from odscen.formats.tracks.lane_places import (
    LaneFit,
    estimate_offset,
    moving_vehicles,
    share_on_lanes,
)
from odscen.formats.tracks.moments import (
    MOMENT_FILES,
    ROWS_FILE,
    Moments,
    read_moments,
    write_moments,
)
from odscen.formats.tracks.read_recording import choose_recording, map_offset, read_recording_parts
from odscen.formats.tracks.recorded_traffic import RecordedTraffic, join_parts, shift_tracks
from odscen.formats.tracks.scenario_of_tracks import SceneChoice, scenario_of_tracks
from odscen.formats.tracks.scenes import exposure, find_scenes
from odscen.maps.allowances import for_recording
from odscen.maps.child_process import work_in_child
from odscen.maps.folder_names import check_name, is_name, name_from_file
from odscen.maps.importers.base import ImportSettings
from odscen.maps.store import Workspace
from odscen.opendrive.parse import parse

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from odscen.app.exchange.imports import AddedMaps
    from odscen.maps.map_entry import MapEntry
    from odscen.maps.store import ProgressCallback
    from odscen.scenario.document.scenario_document import Scenario

_ABOUT, _TRACKS, _PLACED = "about.json", "tracks", "placed"
"""What is known of it; and tracks, of which large recordings have several files."""
_PICTURE: Final = "agreement.svg"
_FILES: Final = "files"
_MOST_FILES: Final = 40
MOST_USERS: Final = 50_000
"""Road users of a recording that is kept; those of highD have 3,000 at most."""
MOST_SCENES: Final = 10_000
"""Scenes that are kept of it, the first ones; how many there are is said of all."""
SEARCHED_AT_ONCE: Final = 16_000_000
"""Bytes of files of which scenes are looked for before they are shown."""
_SAMPLE: Final = 100_000
"""States of moving vehicles by which the map of a recording, and its offset, are found."""
_MOST_DRAWN: Final = 1_000_000
"""States that a picture of the agreement is drawn of, at most."""
_MAP_ENDINGS: Final = (".xodr", ".json", ".osm", ".osm.gz", ".osm.bz2", ".pbf")
_ON_MAP: Final = 0.8
"""Share of the states of moving vehicles on lanes from which on a map of the workspace is taken to
be that of a recording."""
_PATIENCE: Final = 30.0
_GHOST_STEP: Final = 0.2
"""Seconds between places of tracks that a scenario keeps to be shown under it."""


class SentPath(NamedTuple):
    """A file that was sent: the name that its sender gave it, and where it lies."""

    name: str
    path: Path


class FittingMap(NamedTuple):
    """A map of the workspace, and the share of states of moving vehicles that lie on its lanes."""

    map: str
    on_lane: float


class RecordingScenario(NamedTuple):
    """A scenario of a part of a recording.

    Attributes
    ----------
    report
        Who became an actor, and who did not: lists by verdict, as plain values.
    ghosts
        Tracks that are shown under it, as plain values; see :func:`ghosts_of_tracks`.
    """

    scenario: Scenario
    report: dict[str, list[dict[str, Any]]]
    ghosts: list[dict[str, Any]]


@dataclass(frozen=True, slots=True, eq=False)
class KeptRecording:
    """A recording of the workspace.

    Attributes
    ----------
    about
        As plain values: ``file``, ``schema``, ``summary``, ``map``, ``offset``, ``agreement``,
        ``exposure``, ``users``, ``scenes``, ``origin``, ``added`` (maps that came with it) and
        ``unused`` (files that were sent and not needed). Of one that has not been searched yet
        ``agreement`` and ``exposure`` are null.
    """

    name: str
    folder: Path
    about: dict[str, Any]

    def moments(self, begin: float, end: float, *, most: int) -> Moments:
        """Who was where, see :func:`~odscen.formats.tracks.moments.read_moments`."""
        with disk_errors(f"recording {self.name!r}"):
            for file in MOMENT_FILES:
                self.checked(file)
            return read_moments(self.folder, begin, end, most=most)

    @property
    def is_searched(self) -> bool:
        """Whether it has been laid on the lanes of its map, and scenes have been looked for."""
        return self.about["exposure"] is not None

    def tracks(self) -> list[pl.LazyFrame]:
        """Its tracks, in the frame of its map, each part with all of its road users."""
        files = _part_files(self.folder, _PLACED) or _part_files(self.folder, _TRACKS)
        return [pl.scan_parquet(self.checked(file.name)) for file in files]

    def picture(self) -> bytes:
        """Map and tracks, as SVG; :class:`NotFoundError` without a map."""
        if self.about["map"] is None or not self.is_searched:
            raise NotFoundError("drawing of recording", self.name, [])
        return self.checked(_PICTURE).read_bytes()

    def checked(self, file: str) -> Path:
        """Path of one of its files, which is as it was written.

        Raises
        ------
        DamagedError
            If it was changed since.
        """
        path = self.folder / file
        try:
            about = path.stat()
        except OSError:
            check_files(self.folder, only=(file,))
            raise
        _check_once(self.folder, file, about.st_mtime_ns, about.st_ctime_ns, about.st_size)
        return path


def _part_files(folder: Path, stem: str) -> list[Path]:
    return sorted(folder.glob(f"{stem}*.parquet"), key=lambda file: (len(file.name), file.name))


def _part_file(folder: Path, stem: str, number: int) -> Path:
    """The first one is called as it was when there was one only."""
    return folder / (f"{stem}-{number:03}.parquet" if number else f"{stem}.parquet")


@lru_cache(maxsize=1024)
def _check_once(folder: Path, file: str, *_stamp: int) -> None:
    """Compare a file with its checksum unless it is known to be that file: it may be large."""
    check_files(folder, only=(file,))


def recording_names(workspace: Workspace) -> list[str]:
    """Names of all recordings, those that came last first."""
    folder = workspace.recordings
    if not folder.is_dir():
        return []
    found = [
        path for path in folder.iterdir() if is_name(path.name) and (path / SUMS_FILE).is_file()
    ]
    times = {path: (path / SUMS_FILE).stat().st_mtime for path in found}
    return [path.name for path in sorted(found, key=lambda path: (-times[path], path.name))]


def open_recording(workspace: Workspace, name: str) -> KeptRecording:
    """One of them.

    Raises
    ------
    NotFoundError
        If there is none of that name.
    DamagedError
        If what is known of it is not as it was written.
    """
    folder = _recording_folder(workspace, name)
    about = json.loads(read_checked(folder, _ABOUT, read_sums(folder) or {}))
    return KeptRecording(name, folder, about)


def remove_recording(workspace: Workspace, name: str) -> None:
    """Delete a recording, damaged or not; scenarios that were made of it stay as they are.

    Raises
    ------
    NotFoundError
        If there is none of that name.
    ConflictError
        If it is being placed on a map.
    """
    folder = _recording_folder(workspace, name)
    what = f"recording {name!r}"
    # Who places it now would put it back.
    with disk_errors(what), locked(folder, what=what):
        _recording_folder(workspace, name)
        discard(folder)


def _recording_folder(workspace: Workspace, name: str) -> Path:
    check_name(name, what="recording")
    folder = workspace.recordings / name
    if not (folder / SUMS_FILE).is_file():  # none is without one
        raise NotFoundError("recording", name, recording_names(workspace))
    return folder


def add_recording(
    workspace: Workspace,
    files: Sequence[SentPath],
    *,
    on_map: str | None = None,
    search: bool = True,
    progress: ProgressCallback,
) -> KeptRecording:
    """Keep a recording, with its map.

    That is ``on_map``, else the one that was sent with it or is in its file (lanelets, OpenDRIVE),
    which is added to the workspace, else the one of the workspace whose lanes most of its vehicles
    are on, if that is so of 80 % of their states.

    Parameters
    ----------
    files
        Those of the recording, and perhaps its map.
    search
        Whether its agreement with the map and its scenes are found before it is there; else
        :func:`search_recording` does that later.

    Raises
    ------
    InputError
        If there is no recording among the files, or it is damaged; names file, element and value.
    LimitError
        If reading needs more than files of their size may.
    """
    if len(files) > _MOST_FILES:
        raise InputError(f"more than {_MOST_FILES} files were sent")
    named = [SentPath(_safe_name(sent.name), sent.path) for sent in files]
    names = [sent.name for sent in named]
    if twice := sorted({name for name in names if names.count(name) > 1}):
        raise InputError(f"several files that were sent are called {some_of(twice)}")
    maps = [sent for sent in named if sent.name.lower().endswith(_MAP_ENDINGS)]
    tracks = [sent for sent in named if sent not in maps]
    if not tracks:
        raise InputError("no recorded traffic was sent, but maps only")
    progress("reading the recording", 0.0)
    stem = name_from_file(Path(tracks[0].name))
    with _new_recording(workspace, stem) as (name, folder), maps_for_import() as added:
        (folder / _FILES).mkdir()
        for sent in tracks:
            _link_or_copy(sent.path, folder / _FILES / sent.name)
        size = sum(sent.path.stat().st_size for sent in tracks)
        read = _read_in_child(
            "read_sent_recording",
            folder,
            size,
            lambda step, share: progress(step, 0.6 * share),
            names=[sent.name for sent in tracks],
            find_in=str(workspace.root) if on_map is None and not maps else None,
        )
        main = next(sent for sent in tracks if sent.name == read["file"])
        if read["map_within"]:
            maps = [*maps, main]
        chosen = on_map or read["map"]
        if chosen is None and maps:
            if len(maps) > 1:
                listed = ", ".join(sent.name for sent in maps)
                raise InputError(f"several maps were sent: {listed}; send one")
            entry = _add_sent_map(
                workspace, maps[0], read["schema"], added,
                lambda step, share: progress(step, 0.6 + 0.1 * share),
            )  # fmt: skip
            chosen = entry.name
        shutil.rmtree(folder / _FILES)
        about = json.loads((folder / _ABOUT).read_text(encoding="utf-8"))
        sha256 = None if chosen is None else workspace.stored(chosen).sha256
        about |= {"map": chosen, "map_sha256": sha256, "added": [entry.name for entry in added]}
        (folder / _ABOUT).write_text(json.dumps(about), encoding="utf-8")
        if search:
            _place_in_child(workspace, folder, size, lambda w, s: progress(w, 0.7 + 0.3 * s))
        write_sums(folder, sums_of(folder), hidden=True)
    return open_recording(workspace, name)


def _link_or_copy(file: Path, to: Path) -> None:
    """Have a file, which may be large, in another folder too; it is only read there."""
    try:
        os.link(file.resolve(), to)
    except OSError:  # it lies on another disk, or this one has no links
        shutil.copyfile(file, to)


def search_recording(
    workspace: Workspace, name: str, *, progress: ProgressCallback
) -> KeptRecording:
    """Lay a recording on the lanes of the map that it has, and look for its scenes."""
    kept = open_recording(workspace, name)
    offset = ",".join(map(str, kept.about["offset"]))
    return place_recording(
        workspace, name, on_map=kept.about["map"], offset=offset, progress=progress
    )


def place_recording(
    workspace: Workspace,
    name: str,
    *,
    on_map: str | None,
    offset: str = "",
    estimate: bool = False,
    progress: ProgressCallback,
) -> KeptRecording:
    """Place a recording on another map, or elsewhere on it.

    Parameters
    ----------
    offset
        ``X,Y[,DEGREES]`` from the frame of the file to that of the map.
    estimate
        Whether it is then moved onto the lanes.

    Raises
    ------
    InputError
        If the offset is none, or none can be estimated.
    NotFoundError
        If there is no such map.
    """
    kept = open_recording(workspace, name)
    is_moved = list(map_offset(offset)) != list(
        map_offset(",".join(map(str, kept.about["offset"])))
    )
    if on_map is not None:
        workspace.stored(on_map)
    progress("placing the recording on a map", 0.0)
    tracks = [kept.checked(file.name) for file in _part_files(kept.folder, _TRACKS)]
    size = sum(file.stat().st_size for file in tracks)
    with (
        disk_errors(f"recording {name!r}"),
        locked(kept.folder, what=f"recording {name!r}", patience=_PATIENCE),
        new_folder(kept.folder) as folder,
    ):
        shutil.copyfile(kept.checked(_ABOUT), folder / _ABOUT)
        same = [] if is_moved or estimate else [kept.checked(file) for file in MOMENT_FILES]
        for file in (*tracks, *same):
            _link_or_copy(file, folder / file.name)
        _place_in_child(
            workspace, folder, 4 * size, progress,  # it is packed
            map_name=on_map, offset=offset, estimate=estimate,
        )  # fmt: skip
        write_sums(folder, sums_of(folder), hidden=True)
    return open_recording(workspace, name)


def fitting_maps(workspace: Workspace, rows: pl.DataFrame) -> list[FittingMap]:
    """Maps of the workspace on whose lanes moving vehicles of a recording are, the best first."""
    found = []
    for entry in workspace.maps():
        share = share_on_lanes(rows, entry.graph())
        if share > 0.0:
            found.append(FittingMap(entry.name, round(share, 4)))
    return sorted(found, key=lambda fit: (-fit.on_lane, fit.map))


def fitting_maps_of(workspace: Workspace, name: str) -> list[FittingMap]:
    """The same for one that is kept, where it is placed now."""
    kept = open_recording(workspace, name)
    with disk_errors(f"recording {name!r}"):
        return fitting_maps(workspace, _sample_of(kept.tracks()))


def _sample_of(parts: Sequence[pl.LazyFrame]) -> pl.DataFrame:
    """States of moving vehicles, evenly out of all if there are many."""
    columns = ("x", "y", "hdg", "speed", "category")
    rows = [moving_vehicles(part.select(columns)) for part in parts]
    count = sum(part.select(pl.len()).collect().item() for part in rows)
    every = max(1, count // _SAMPLE)
    return pl.concat([part.gather_every(every).collect() for part in rows])


def scenario_of_recording(
    workspace: Workspace, name: str, choice: SceneChoice, *, begin: float, end: float
) -> RecordingScenario:
    """A scenario of a part of a recording.

    With an ego it has the criterion that this one does not collide.

    Raises
    ------
    InputError
        If the recording has no map, or as of
        :func:`~odscen.formats.tracks.scenario_of_tracks.scenario_of_tracks`.
    """
    kept = open_recording(workspace, name)
    about = kept.about
    if about["map"] is None:
        raise InputError("a scenario needs a map: choose the one that the recording is of")
    if not begin < end:
        raise InputError(f"the window from {begin:g} to {end:g} s is empty")
    with disk_errors(f"recording {name!r}"):
        rows = (
            pl.concat(kept.tracks())
            .filter(pl.col("time").is_between(begin - 1e-6, end + 1e-6))
            .collect(engine="streaming")
        )
    if not rows.height:
        raise InputError(f"the recording has no road user from {begin:g} to {end:g} s")
    entry = workspace.map_for(about["map"], about["map_sha256"])
    the_map = ImportMap(
        entry.name, entry.sha256, load_map(entry).sumo, lambda: parse(entry.read("xodr"))
    )
    report = ElementReport(about["file"])
    scenario = scenario_of_tracks(
        RecordedTraffic(rows, about["schema"], about["summary"]["step"]),
        the_map,
        choice,
        name=f"{name} {begin:g} to {end:g} s",
        assets=workspace.assets(),
        report=report,
    )
    if any(actor.ego for actor in scenario.actors):
        scenario = scenario.model_copy(update={"criteria": ("collided(ego) == 0",)})
    actors = {
        row.xpath.removeprefix("road user "): row.reason.removeprefix("actor ")
        for row in report.lists["taken"]
    }
    lists = {verdict: [row._asdict() for row in report.lists[verdict]] for verdict in VERDICTS}
    step = min(max(round(about["summary"]["step"], 3), 0.01), 0.1)
    later = step - float(rows["time"].min())  # type: ignore[arg-type]
    return RecordingScenario(scenario, lists, ghosts_of_tracks(rows, actors, later))


def ghosts_of_tracks(
    rows: pl.DataFrame, actors: dict[str, str], later: float
) -> list[dict[str, Any]]:
    """Tracks as they are shown under a scenario.

    Parameters
    ----------
    actors
        Of each road user that became one, the actor.
    later
        Seconds by which the time of the run is later than that of the recording.

    Returns
    -------
    list of dict
        Of each: ``id``, ``actor`` (null: none), ``category``, ``length``, ``width`` and columns
        ``time`` (s of the run), ``x``, ``y`` (m) and ``hdg`` (rad), five in a second.
    """
    ghosts = []
    for (user,), own in rows.group_by("id", maintain_order=True):
        cell = (pl.col("time") / _GHOST_STEP).floor()
        is_last = pl.int_range(pl.len()) == pl.len() - 1
        kept = own.filter((cell != cell.shift()).fill_null(value=True) | is_last)
        length, width = (own[size].drop_nulls().median() for size in ("length", "width"))
        ghosts.append(
            {
                "id": str(user),
                "actor": actors.get(str(user)),
                "category": own["category"][0],
                "length": length or 4.5,
                "width": width or 1.8,
                "time": [round(time + later, 3) for time in kept["time"]],
                **{name: [round(v, 3) for v in kept[name]] for name in ("x", "y", "hdg")},
            }
        )
    return ghosts


# ---------------------------------------------------------------------------- files and maps


def _safe_name(name: str) -> str:
    bare = printable(PurePosixPath(name.replace("\\", "/")).name)
    return re.sub(r"[^\w.,()+ -]", "_", bare).lstrip(".")[:120] or "file"


def _free_name(stem: str, taken: Sequence[str]) -> str:
    names = (stem if n == 1 else f"{stem[:56]}-{n}" for n in count(1))
    return next(name for name in names if name not in taken)


@contextmanager
def _new_recording(workspace: Workspace, stem: str) -> Iterator[tuple[str, Path]]:
    """Yield a free name, and the folder that becomes that recording."""
    with disk_errors("recordings"), ExitStack() as stack:
        taken = recording_names(workspace)
        while True:
            name = check_name(_free_name(stem, taken), what="recording")
            final = workspace.recordings / name
            taken.append(name)
            with suppress(ConflictError):  # one of that name is being made beside us
                stack.enter_context(locked(final, what=f"recording {name!r}"))
                if not final.exists():  # nor has been since
                    break
                stack.close()
        yield name, stack.enter_context(new_folder(final))


def _read_in_child(
    job: str, folder: Path, size: int, progress: ProgressCallback, **arguments: Any
) -> dict[str, Any]:
    return work_in_child(
        f"{__name__}:{job}",
        what="reading the recording",
        arguments={"folder": str(folder), **arguments},
        folders=(folder,),
        allowance=for_recording(size),
        progress=progress,
    )


def _place_in_child(
    workspace: Workspace,
    folder: Path,
    size: int,
    progress: ProgressCallback,
    *,
    map_name: str | None = None,
    offset: str = "",
    estimate: bool = False,
) -> None:
    """Place a recording; without a name and an offset on the map that it has."""
    _read_in_child(
        "place_kept_recording",
        folder,
        size,
        progress,
        workspace=str(workspace.root),
        map_name=map_name,
        offset=offset,
        estimate=estimate,
    )


def _add_sent_map(
    workspace: Workspace,
    sent: SentPath,
    schema: str,
    added: AddedMaps,
    progress: ProgressCallback,
) -> MapEntry:
    """The map of a file that was sent, added if the workspace does not have it."""
    content = sent.path.read_bytes()
    sha256 = digest(content)
    # These count metres from latitude and longitude 0.
    counts_from_zero = schema in ("interaction", "sind") and sent.name.lower().endswith(".osm")
    options = {"origin": "0,0"} if counts_from_zero else {}

    def is_same(entry: MapEntry) -> bool:
        if entry.sha256 == sha256:
            return True
        given = all(entry.importing.options.get(key) == options[key] for key in options)
        return entry.source_sha256 == sha256 and given

    known = workspace.first_map(is_same)
    if known is not None:
        return known
    entry = workspace.add_map_content(
        content,
        file=sent.name,
        name=_free_name(name_from_file(Path(sent.name)), workspace.map_names()),
        importing=ImportSettings(options=options),
        progress=progress,
    )
    added.append(entry)
    return entry


# ---------------------------------------------------------------------------- in the child


def read_sent_recording(
    *,
    folder: str,
    names: Sequence[str],
    find_in: str | None,
    progress: Callable[[str, float], None],
) -> dict[str, Any]:
    """Read the files, and write their tracks, also by time, and what is known of them.

    A job of a child.

    Parameters
    ----------
    find_in
        A workspace among whose maps the one is looked for on whose lanes its vehicles are.

    Returns
    -------
    dict
        ``file``, ``schema``, ``map``, and ``map_within``: whether the file has a map, too.
    """
    progress("reading the recording", 0.0)
    place = Path(folder)
    files = [DiskFile(place / _FILES / name) for name in names]
    main = files[choose_recording(files)]
    read: list[RecordedTraffic] = []
    users = 0
    for part in read_recording_parts(main):
        users += part.rows["id"].n_unique()
        if users > MOST_USERS:
            raise LimitError(
                f"{main.name}: it has more than {MOST_USERS:,} road users; send a part of it"
            )
        part.rows.write_parquet(_part_file(place, _TRACKS, len(read)), compression="lz4")
        read.append(replace(part, rows=part.rows.clear()))
        progress("reading the recording", 0.4)
    recorded = join_parts(read, read[0].rows)
    parts = [pl.scan_parquet(file) for file in _part_files(place, _TRACKS)]
    summary: dict[str, Any] = recorded.summary(parts)
    progress("writing it by time", 0.5)
    listed, origin = write_moments(parts, place)
    found = None
    within = main.name.lower().endswith(".xml")
    if find_in is not None and not within:
        progress("looking for its map", 0.9)
        fits = fitting_maps(Workspace.open(Path(find_in)), _sample_of(parts))
        found = fits[0].map if fits and fits[0].on_lane >= _ON_MAP else None
    needed = {main.name, *recorded_beside(main.name, names)}
    about = {
        "file": main.name,
        "schema": recorded.schema,
        "summary": summary,
        "unused": sorted(set(names) - needed),
        "offset": [0.0, 0.0, 0.0],
        "agreement": None,
        "exposure": None,
        "users": listed,
        "origin": origin,
        "bounds": _bounds_of(summary),
        "scenes": [],
    }
    (place / _ABOUT).write_text(json.dumps(about), encoding="utf-8")
    return {
        "file": main.name, "schema": recorded.schema, "map": found, "map_within": within,
    }  # fmt: skip


def _bounds_of(summary: Mapping[str, Any]) -> list[float]:
    return [round(summary[axis][end], 3) for end in (0, 1) for axis in ("x", "y")]


def recorded_beside(main: str, names: Sequence[str]) -> list[str]:
    """Names of files that readers look for beside one of a recording."""
    pairs = [
        ("vehicle_tracks", "pedestrian_tracks"),
        ("pedestrian_tracks", "vehicle_tracks"),
        ("Veh_smoothed", "Ped_smoothed"),
        ("Ped_smoothed", "Veh_smoothed"),
        ("_tracks.", "_tracksMeta."),
        ("_tracks.", "_recordingMeta."),
    ]
    wanted = {main.replace(own, other) for own, other in pairs if own in main}
    if "smoothed_tracks" in main:
        wanted.add("Traffic_Lights.csv")
    return sorted(wanted & set(names))


def place_kept_recording(
    *,
    folder: str,
    workspace: str,
    map_name: str | None,
    offset: str,
    estimate: bool,
    progress: Callable[[str, float], None],
) -> dict[str, Any]:
    """Place tracks on a map, and find their scenes; a job of a child."""
    progress("placing the recording on a map", 0.0)
    place, store = Path(folder), Workspace.open(Path(workspace))
    about = json.loads((place / _ABOUT).read_text(encoding="utf-8"))
    map_name = map_name or about["map"]
    entry = None if map_name is None else store.map(map_name)
    files = _part_files(place, _TRACKS)
    x, y, turn = map_offset(offset)
    if estimate and entry is not None:
        rows = shift_tracks(_sample_of([pl.scan_parquet(file) for file in files]), x, y, turn)
        by = estimate_offset(rows, entry.graph())
        moved = shift_tracks(pl.DataFrame({"x": [x], "y": [y], "hdg": [turn]}), *by)
        x, y, turn = (float(moved[name][0]) for name in ("x", "y", "hdg"))
    parts = [pl.scan_parquet(file) for file in files]
    fit = None if entry is None else LaneFit(entry.graph())
    if fit is not None or (x, y, turn) != (0.0, 0.0, 0.0):
        for number, part in enumerate(parts):
            rows = part.collect()
            if (x, y, turn) != (0.0, 0.0, 0.0):
                rows = shift_tracks(rows, x, y, turn)
            placed = rows if fit is None else fit.place(rows)
            placed.write_parquet(_part_file(place, _PLACED, number), compression="lz4")
            progress("placing the recording on a map", 0.3 * (number + 1) / len(parts))
        parts = [pl.scan_parquet(file) for file in _part_files(place, _PLACED)]
    if not (place / ROWS_FILE).is_file():
        progress("writing it by time", 0.3)
        about["users"], about["origin"] = write_moments(parts, place)
    progress("looking for scenes", 0.4)
    graph = None if entry is None else entry.graph()
    found = find_scenes(
        parts, graph, progress=lambda share: progress("looking for scenes", 0.4 + 0.5 * share)
    )
    if entry is not None:
        progress("drawing it on the map", 0.9)
        draw_tracks_on_map(entry, _drawn_of(parts), place / _PICTURE)
    notes = [note for note in about["summary"]["notes"] if not note.startswith("and ")]
    if found.height > MOST_SCENES:
        more = found.height - MOST_SCENES
        notes.append(f"and {more:,} more scenes, which are not listed")
    about["summary"]["notes"] = notes
    recorded = RecordedTraffic(pl.DataFrame(), about["schema"], about["summary"]["step"])
    about |= {
        "map": None if entry is None else entry.name,
        "map_sha256": None if entry is None else entry.sha256,
        "offset": [round(x, 3), round(y, 3), round(degrees(turn), 4)],
        "agreement": None if fit is None else fit.agreement(),
        "exposure": exposure(parts, found),
        "bounds": _bounds_of(recorded.summary(parts)),
        "scenes": found.head(MOST_SCENES).to_dicts(),
    }
    (place / _ABOUT).write_text(json.dumps(about), encoding="utf-8")
    return {}


def _drawn_of(placed: Sequence[pl.LazyFrame]) -> pl.DataFrame:
    """What is drawn of tracks: of many states so many of each road user, evenly."""
    count = sum(part.select(pl.len()).collect().item() for part in placed)
    every = max(1, -(-count // _MOST_DRAWN))
    columns = ("id", "category", "x", "y", "on_lane", "wrong_way")
    return pl.concat([part.select(columns).gather_every(every).collect() for part in placed])
