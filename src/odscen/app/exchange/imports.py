"""Files of foreign formats read from the disk, with what they name: catalogs, other files, maps."""

from __future__ import annotations

import json
import os
import re
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING, Final, NamedTuple

from odscen.app.maps import load_map
from odscen.app.scenarios import check_scenario, write_scenario
from odscen.base.atomic_folders import discard, scratch_folder
from odscen.base.checksums import digest
from odscen.base.errors import InputError, NotFoundError, ToolError
from odscen.base.given_files import MOST, as_path, read_given
from odscen.base.shown import printable
from odscen.base.system_errors import disk_errors
from odscen.base.text_files import write_text
from odscen.formats import find_format, format_of_file
from odscen.formats.base import ImportMap, ImportSource
from odscen.maps.allowances import BY_SIZE
from odscen.maps.converters import GivenNetwork
from odscen.maps.folder_names import check_name, name_from_file
from odscen.maps.map_files import read_map_file
from odscen.maps.netconvert import opendrive_of_network
from odscen.opendrive.parse import parse

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    import polars as pl

    from odscen.base.given_files import GivenPath
    from odscen.formats.base import FileContent, GivenFile, ReportRow
    from odscen.maps.allowances import BuildLimits
    from odscen.maps.map_entry import MapEntry
    from odscen.maps.store import ProgressCallback, Workspace
    from odscen.scenario.document.problems import Problem
    from odscen.scenario.document.scenario_document import Scenario
    from odscen.scenario.sweeps.sweep_plan import SweepPlan

    AddedMaps = list[MapEntry]

_FOLDERS_ABOVE: Final = 3
"""Folders above a file that may have the catalogs it names."""
_VARIABLE: Final = re.compile(r"\$\{(\w+)\}")


class ImportedFile(NamedTuple):
    """What has come of a file.

    Attributes
    ----------
    scenario
        The document; ``None`` if the file has tracks.
    tracks
        Table of tracks, see :data:`~odscen.formats.tracks.recorded_traffic.TRACK_COLUMNS`; ``None``
        if the file has a scenario.
    lists
        Elements of the file, each with a reason, by what has become of them: ``taken``,
        ``approximated``, ``ignored`` and ``refused``; empty of formats that are always taken whole.
    problems
        What :func:`odscen.check` finds in the scenario.
    plan
        What a file varies, as a sweep; ``None`` of others, and if none of its parameters settles a
        number of the scenario.
    plan_file
        Where that has been written.
    """

    scenario: Scenario | None
    tracks: pl.DataFrame | None
    lists: Mapping[str, Sequence[ReportRow]]
    problems: tuple[Problem, ...]
    plan: SweepPlan | None = None
    plan_file: Path | None = None


def import_file(
    workspace: Workspace,
    path: GivenPath,
    *,
    out: GivenPath | None = None,
    of: str | None = None,
    maps: GivenPath | None = None,
    on_map: str | None = None,
    options: Mapping[str, str] | None = None,
    limits: BuildLimits = BY_SIZE,
    progress: ProgressCallback | None = None,
) -> ImportedFile:
    """Read a file of a foreign format: a scenario, or tracks of a recording.

    A map that it names is looked for beside it, in the folder ``maps``, and by its name in the
    workspace; one that is found as a file is added to the workspace, under a free name if its own
    is taken, and removed again if the file is then refused. Of a parameter value distribution of
    OpenSCENARIO it is the scenario that it names, and the plan of the sweep is written beside
    ``out``, with ``.sweep.json`` in the place of ``.scenario.json``.

    Parameters
    ----------
    workspace
        Has the maps.
    path
        The file.
    out
        Where the scenario is written; or the tracks, as CSV or Parquet by its ending. Nothing is
        written if not given.
    of
        Name of the format; by the ending of the file if not given.
    maps
        Another folder of maps.
    on_map
        The map on which it plays, whatever the file names: an OpenDRIVE file, or the name of a map
        of the workspace.
    options
        What the format lets one choose: of ``openscenario`` with ``ego`` what drives the ego,
        ``story`` or ``sumo``.
    limits
        What building a map of a SUMO network may use.
    progress
        Hears what of that map is being built, and the share that is done.

    Returns
    -------
    ImportedFile
        The scenario or the tracks, with the report on the file.

    Raises
    ------
    InputError
        If the file cannot be read, or is not of the format; names element and line.
    NotFoundError
        If there is no such format, or the map ``on_map`` is not found.
    NoMapError
        If the map of an OpenSCENARIO file is not found, or it names none; has the report of the
        rest.
    LimitError
        If a map that is made of a network needs more than it may have.
    WorkspaceError
        If a file cannot be written.
    """
    path = as_path(path)
    out = None if out is None else as_path(out)
    more_maps = None if maps is None else as_path(maps)
    with maps_for_import() as added:
        entry = None if on_map is None else _map_of_name_or_file(workspace, on_map, added)

        def find_map(named: str, file: GivenFile) -> MapEntry:
            return entry or _map_beside(workspace, Path(file.where), more_maps, named, added)

        content = read_content(
            workspace,
            of or format_of_file(str(path)).id,
            DiskFile(path),
            name=name_from_file(path),
            find_entry=find_map,
            options=options,
            map_given=on_map is not None or maps is not None,
            bring=partial(
                map_of_network,
                workspace,
                on_map=entry,
                added=added,
                limits=limits,
                progress=progress,
            ),
        )
        plan_file = None
        if out is not None and content.tracks is not None:
            _write_tracks(content.tracks, out)
        if content.scenario is None:
            return ImportedFile(None, content.tracks, content.lists, ())
        problems = check_scenario(workspace, content.scenario)
        if out is not None:
            write_scenario(content.scenario, out)
            if content.plan is not None:
                stem = out.name.removesuffix(".json").removesuffix(".scenario")
                plan_file = write_text(out.with_name(f"{stem}.sweep.json"), plan_text(content.plan))
        return ImportedFile(
            content.scenario, content.tracks, content.lists, problems, content.plan, plan_file
        )


def read_content(
    workspace: Workspace,
    of: str,
    file: GivenFile,
    *,
    name: str,
    find_entry: Callable[[str, GivenFile], MapEntry],
    options: Mapping[str, str] | None = None,
    map_given: bool = False,
    bring: Callable[[str, bytes], MapEntry] | None = None,
) -> FileContent:
    """Read a file, from wherever it and what it names lie.

    Parameters
    ----------
    of
        Name of the format.
    name
        Of the scenario.
    find_entry
        Gives the map that a file names.
    bring
        Makes a map of a SUMO network; in the workspace under the name of its file if not given.

    Raises
    ------
    InputError
        If nothing is read of the format, it has no such option, or as of :func:`import_file`.
    NotFoundError, NoMapError
        As of :func:`import_file`.
    """
    chosen = find_format(of)
    if chosen.read is None:
        raise InputError(f"the format {of} is only written", file=file.where)
    chosen.refuse_unknown_options(options or {})

    def bring_network(named: str, content: bytes) -> ImportMap:
        entry = (bring or partial(map_of_network, workspace))(named, content)
        sumo_map = load_map(entry).sumo
        return ImportMap(entry.name, entry.sha256, sumo_map, lambda: parse(entry.read("xodr")))

    def find_map(named: str, asking: GivenFile) -> ImportMap:
        entry = find_entry(named, asking)
        sumo_map = load_map(entry).sumo
        return ImportMap(entry.name, entry.sha256, sumo_map, lambda: parse(entry.read("xodr")))

    return chosen.read(
        ImportSource(
            name=name,
            file=file,
            find_map=find_map,
            assets=workspace.assets(),
            options=dict(options or {}),
            map_given=map_given,
            bring_network=bring_network,
        )
    )


@contextmanager
def maps_for_import() -> Iterator[AddedMaps]:
    """Yield a list for maps that are added for a file; they are removed if the block raises."""
    added: AddedMaps = []
    try:
        yield added
    except BaseException:
        for entry in added:
            discard(entry.folder)
        raise


def known_or_added(
    workspace: Workspace,
    content: bytes,
    file: str,
    added: AddedMaps,
    progress: ProgressCallback | None = None,
) -> MapEntry:
    """The map of the workspace with the content of a file.

    It is added if there is none, under a free name: scenarios may need what has its own.
    """
    sha256 = digest(content)
    known = workspace.first_map(lambda entry: entry.sha256 == sha256)
    if known is not None:
        return known
    name = _free_map_name(workspace, name_from_file(Path(file)))
    added.append(workspace.add_map_content(content, file=file, name=name, progress=progress))
    return added[-1]


def _free_map_name(workspace: Workspace, wanted: str) -> str:
    taken = set(workspace.map_names())
    names = (wanted if n == 1 else f"{wanted[:56]}-{n}" for n in count(1))
    return check_name(next(name for name in names if name not in taken))


def map_of_network(
    workspace: Workspace,
    named: str,
    content: bytes,
    *,
    on_map: MapEntry | None = None,
    added: AddedMaps | None = None,
    limits: BuildLimits = BY_SIZE,
    progress: ProgressCallback | None = None,
) -> MapEntry:
    """The map that has a SUMO network, made of it if there is none.

    OpenDRIVE is made of it by netconvert, for what is drawn and placed; the network itself stays
    what it is, with its ids.

    Parameters
    ----------
    named
        File of the network.
    content
        The ``.net.xml``.
    on_map
        The map whose network it is to be.
    added
        Hears of the map if it is a new one.
    limits
        What building it may use.
    progress
        Hears what is being built, and the share that is done.

    Raises
    ------
    LimitError
        If it needs more.
    InputError
        If it is no network, or none of that map; if netconvert refuses it, with the first error
        that it names, crashes or passes a limit.
    """
    sha256 = digest(content)

    def has_it(entry: MapEntry) -> bool:
        return str(entry.info["network"]["sha256"]) == sha256

    if on_map is not None:
        if has_it(on_map):
            return on_map
        with scratch_folder() as folder:
            file = folder / "given.net.xml"
            file.write_bytes(content)
            return workspace.set_network(on_map.name, file, limits=limits, progress=progress)
    known = workspace.first_map(has_it)
    if known is not None:
        return known
    bare = re.sub(r"(\.net)?(\.xml)?(\.gz)?$", "", named.rpartition("/")[2], flags=re.IGNORECASE)
    bare = re.sub(r"[^A-Za-z0-9_.-]+", "-", bare).strip("-._")[:60] or "network"
    name = _free_map_name(workspace, bare)
    try:
        xodr, _ = opendrive_of_network(content)
    except ToolError as error:
        said = [line for line in error.output.splitlines() if line.startswith("Error: ")]
        words = (said or str(error).splitlines())[0].removeprefix("Error: ")
        raise InputError(
            f"the SUMO network cannot be read: {words}", file=printable(named)
        ) from error
    entry = workspace.add_map_content(
        xodr, file=f"{name}.xodr", name=name, network=GivenNetwork(content, printable(named)),
        limits=limits, progress=progress,
    )  # fmt: skip
    if added is not None:
        added.append(entry)
    return entry


def plan_text(plan: SweepPlan) -> str:
    """The file of a plan."""
    return json.dumps(plan.to_dict(), indent=2, ensure_ascii=False) + "\n"


def bare_map_name(named: str) -> str:
    """Name of a map as a file names it, without folder and ending."""
    return _with_slashes(named).rpartition("/")[2].removesuffix(".xodr")


def _write_tracks(tracks: pl.DataFrame, out: Path) -> None:
    with disk_errors(str(out)):
        out.parent.mkdir(parents=True, exist_ok=True)
        if out.suffix == ".parquet":
            tracks.write_parquet(out)
        else:
            tracks.write_csv(out)


@dataclass(frozen=True, slots=True)
class DiskFile:
    """A file on the disk, and what lies around it."""

    path: Path

    @property
    def name(self) -> str:
        """Name of the file without its folder."""
        return self.path.name

    @property
    def where(self) -> str:
        """The file with its folder."""
        return str(self.path)

    @property
    def on_disk(self) -> Path:
        """The same, as a path."""
        return self.path

    def read(self, *, most: int = MOST) -> bytes:
        """Its content."""
        return read_given(self.path, most=most)

    def other(self, named: str) -> DiskFile:
        """A file that it names, relative to its folder; ``${NAME}`` and ``~/`` are filled in.

        Raises
        ------
        InputError
            If the environment has no variable of that name.
        """
        filled = _VARIABLE.sub(lambda match: self._read_variable(match[1], named), named)
        return DiskFile(self.path.parent / Path(_with_slashes(filled)).expanduser())

    def _read_variable(self, name: str, named: str) -> str:
        value = os.environ.get(name)
        if value is None:
            raise InputError(
                f"the environment has no variable {name}", element=named, file=self.where
            )
        return value

    def others(self, folders: Sequence[str], suffix: str) -> Iterator[DiskFile]:
        """All files with an ending in these folders, relative to its own or one above.

        Euro NCAP's collection names those in ``NCAP/SET/`` as if from ``NCAP/``.
        """
        above = (self.path.parent, *self.path.absolute().parents[1 : 1 + _FOLDERS_ABOVE])
        for folder in folders:
            places = [parent / _with_slashes(folder) for parent in above]
            there = next((place for place in places if place.is_dir()), places[0])
            for path in sorted(there.glob(f"*{suffix}")):
                yield DiskFile(path)


def _map_of_name_or_file(workspace: Workspace, given: str, added: AddedMaps) -> MapEntry:
    if given.lower().endswith(".xodr"):
        return _known_or_added(workspace, Path(given), added)
    return workspace.map(given)


def _map_beside(
    workspace: Workspace, file: Path, maps: Path | None, named: str, added: AddedMaps
) -> MapEntry:
    """The map that a file names: one that is found as a file is added to the workspace.

    Raises
    ------
    NotFoundError
        If there is no such file, and no map of that name in the workspace.
    """
    bare = bare_map_name(named)
    if not bare:
        raise NotFoundError("map", "", workspace.map_names())
    folders = (file.parent, file.parent.parent / "xodr", *((maps,) if maps else ()))
    places = [file.parent / _with_slashes(named)]
    for place in (*places, *(folder / f"{bare}.xodr" for folder in folders)):
        if place.is_file():
            return _known_or_added(workspace, place, added)
    if bare in workspace.map_names():
        return workspace.map(bare)
    raise NotFoundError("map", bare, workspace.map_names())


def _known_or_added(workspace: Workspace, file: Path, added: AddedMaps) -> MapEntry:
    content = read_map_file(file)
    return known_or_added(workspace, content, file.name, added)


def _with_slashes(path: str) -> str:
    return path.replace("\\", "/")
