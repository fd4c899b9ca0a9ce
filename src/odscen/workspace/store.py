"""The workspace: maps, scenarios and runs on disk.

A map is built once (requirement R7) into a folder of its own; the folder is written beside the
final place and renamed into it, so that a half-written map is never visible. Names are checked
before they become paths.
"""

from __future__ import annotations

import hashlib
import json
import os
import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from odscen.base.atomic_folders import new_folder
from odscen.base.errors import InputError, NotFoundError, WorkspaceError, in_file
from odscen.base.shown import printable
from odscen.convert.lane_table.table_json import table_from_json
from odscen.convert.model.conversion_settings import USUAL, ConversionSettings
from odscen.workspace.asset_catalogue import assets_in
from odscen.workspace.map_files import read_map_file

if TYPE_CHECKING:
    import networkx as nx

    from odscen.convert.lane_table.table import LaneTable
    from odscen.convert.model.conversion_settings import ConverterName
    from odscen.convert.verify.fidelity_result import Fidelity
    from odscen.drawing.map_drawing import MapDrawing
    from odscen.lanegraph.graphs import MapGraph
    from odscen.lanegraph.map_statistics import MapStatistics
    from odscen.workspace.asset_catalogue import Assets
    from odscen.workspace.converters import GivenNetwork

BUILDER = "6"
"""Raised whenever what a map folder contains changes; older folders are then rebuilt."""

ENVIRONMENT_VARIABLE = "ODSCEN_WORKSPACE"

_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]{0,63}")

ProgressCallback = Callable[[str, float], None]
"""Called with what is being done and the share done, 0 to 1."""


def check_name(name: str, *, what: str = "map") -> str:
    """Return ``name`` if it can name a folder everywhere, else raise :class:`InputError`."""
    if not _NAME.fullmatch(name):
        msg = (
            f"{what} name {name!r} cannot be used: letters, digits, '_', '-' and '.', "
            "starting with a letter or digit, at most 64"
        )
        raise InputError(msg)
    return name


def name_from_file(path: Path) -> str:
    """Map name for a file: its stem, with everything unusual replaced by ``_``."""
    return plain_name(path.stem) or "map"


def plain_name(text: str) -> str:
    """Text as it can name a folder everywhere, perhaps empty: the unusual replaced by ``_``."""
    return re.sub(r"[^A-Za-z0-9_.-]+", "_", text).strip("._-")[:64]


@dataclass(frozen=True, slots=True, eq=False)
class MapEntry:
    """One map of the catalogue: its folder, and lazy access to what was built.

    Attributes
    ----------
    name
        In the catalogue.
    folder
        With all files.
    info
        As in ``map.json``: hash, settings, statistics, names of the files, import report.
    """

    name: str
    folder: Path
    info: dict[str, Any]

    def __eq__(self, other: object) -> bool:
        """Equal if it is the same build of the same map."""
        return isinstance(other, MapEntry) and self._key == other._key

    def __hash__(self) -> int:
        """Hash of the same."""
        return hash(self._key)

    @property
    def _key(self) -> tuple[Path, str, float, str, str]:
        return self.folder, self.sha256, self.info["spacing"], self.info["builder"], self.net_sha256

    @property
    def sha256(self) -> str:
        """SHA-256 of the .xodr, hexadecimal."""
        return str(self.info["sha256"])

    @property
    def conversion(self) -> ConversionSettings:
        """How it was converted."""
        return ConversionSettings(spacing=float(self.info["spacing"]), converter=self.converter)

    @property
    def converter(self) -> ConverterName:
        """Who wrote its SUMO network."""
        name: ConverterName = self.info.get("network", {}).get("converter", "odscen")
        return name

    @property
    def net_sha256(self) -> str:
        """SHA-256 of its SUMO network, hexadecimal."""
        return str(self.info.get("network", {}).get("sha256", ""))

    def path(self, key: str) -> Path:
        """Absolute path of one of the files named in ``map.json``, for example ``"net"``."""
        return self.folder / str(self.info["files"][key])

    def graph(self) -> MapGraph:
        """Lane graph, segments and pedestrian graph."""
        from odscen.lanegraph.graph_files import from_npz_bytes

        return from_npz_bytes(self.path("graph_npz").read_bytes())

    def networkx(self) -> tuple[nx.MultiDiGraph, nx.Graph]:
        """Lane graph and pedestrian graph, see :func:`odscen.lanegraph.networkx_form.to_networkx`.

        Returns
        -------
        tuple
            The lane graph: nodes are named ``road.section.lane.index`` and have ``x``, ``y``,
            ``z`` (m, OpenDRIVE frame), ``hdg`` (rad), ``width`` (m), ``speed_limit`` (m/s),
            ``segment``; edges have ``relation`` (successor, left, right) and ``length`` (m). Then
            the pedestrian graph, undirected.
        """
        from odscen.lanegraph.networkx_form import to_networkx

        return to_networkx(self.graph())

    def given(self) -> GivenNetwork:
        """Its SUMO network, as it can be given to another build of the map."""
        from odscen.workspace.converters import GivenNetwork

        return GivenNetwork(self.path("net").read_bytes(), str(self.info["network"]["source"]))

    def lane_table(self) -> LaneTable:
        """The table between OpenDRIVE lanes and SUMO lanes."""
        return table_from_json(self.path("lane_table").read_bytes())

    def drawing(self) -> MapDrawing:
        """What is drawn of the map."""
        from odscen.drawing.map_drawing import MapDrawing

        return MapDrawing.from_json(self.path("drawing").read_bytes())

    def fidelity(self) -> Fidelity:
        """How faithfully the SUMO network follows the map, measured from both files anew."""
        from odscen.convert.verify.fidelity import verify
        from odscen.opendrive.lanes import RoadTable
        from odscen.opendrive.parse import parse

        xodr = self.path("xodr")
        odr = parse(xodr.read_bytes(), file=xodr.name)
        with in_file(self.path("net").name):
            return verify(self.path("net").read_bytes(), odr, RoadTable.of(odr))

    def statistics(self) -> MapStatistics:
        """Figures of the map."""
        from odscen.lanegraph.map_statistics import MapStatistics

        values = self.info["statistics"]
        return MapStatistics(**{**values, "bounds": tuple(values["bounds"])})


@dataclass(frozen=True, slots=True)
class Workspace:
    """A folder with ``maps/``, ``scenarios/`` and ``runs/``, perhaps ``assets/``.

    Attributes
    ----------
    root
        The folder.

    Examples
    --------
    >>> workspace = Workspace.open(Path("my-workspace"))
    >>> workspace.add_map(Path("Town01.xodr")).name
    'Town01'
    """

    root: Path

    @classmethod
    def open(cls, root: Path | None = None) -> Workspace:
        """Open the workspace at ``root``, else ``$ODSCEN_WORKSPACE``, else the user's data folder.

        Raises
        ------
        WorkspaceError
            If it cannot be created or written.
        """
        if root is None:
            given = os.environ.get(ENVIRONMENT_VARIABLE)
            if given:
                root = Path(given)
            else:
                from platformdirs import user_data_path

                root = user_data_path("odscen", appauthor=False)
        root = root.expanduser().absolute()
        with _workspace_errors(root):
            (root / "maps").mkdir(parents=True, exist_ok=True)
        return cls(root)

    @property
    def scenarios(self) -> Path:
        """Folder that scenarios are written to by default."""
        return self.root / "scenarios"

    @property
    def assets_folder(self) -> Path:
        """Folder of models that were fetched from a simulator."""
        return self.root / "assets"

    def assets(self) -> Assets:
        """Models and weather: those fetched into this workspace, else those that ship."""
        return assets_in(self.assets_folder)

    @property
    def runs(self) -> Path:
        """Folder that runs are written to by default."""
        return self.root / "runs"

    def map_names(self) -> list[str]:
        """Names of all complete maps, sorted."""
        return sorted(
            folder.name
            for folder in (self.root / "maps").iterdir()
            if _NAME.fullmatch(folder.name) and (folder / "map.json").is_file()
        )

    def maps(self) -> list[MapEntry]:
        """All maps, sorted by name."""
        return [self.map(name) for name in self.map_names()]

    def map(self, name: str) -> MapEntry:
        """One map by name; rebuilt first if an older odscen has built it.

        Raises
        ------
        NotFoundError
            If there is no such map.
        """
        names = self.map_names()
        if name not in names:
            raise NotFoundError("map", name, names)
        folder = self.root / "maps" / name
        entry = _read_entry(folder)
        if entry.info.get("builder") != BUILDER:
            return self.add_map(folder / "map.xodr", name=name, settings=entry.conversion)
        return entry

    def map_for(self, name: str, sha256: str) -> MapEntry:
        """Map that a scenario refers to: of the same content, and of the same name if it can be.

        Raises
        ------
        NotFoundError
            If there is no map of that name and none with that content.
        InputError
            If the map of that name has other content.
        """
        if name in self.map_names():
            entry = self.map(name)
            if entry.sha256 == sha256:
                return entry
        for other in self.maps():
            if other.sha256 == sha256:
                return other
        if name not in self.map_names():
            raise NotFoundError("map", name, self.map_names())
        msg = (
            f"map {name!r} in {self.root} has other content (sha256 {entry.sha256[:12]}...) "
            f"than the one the scenario was made on ({sha256[:12]}...); "
            "add that .xodr under another name"
        )
        raise InputError(msg)

    def add_map(
        self,
        source: Path,
        *,
        name: str | None = None,
        settings: ConversionSettings = USUAL,
        progress: ProgressCallback | None = None,
    ) -> MapEntry:
        """Build everything that later steps need from an OpenDRIVE file, once.

        A map of the same name is replaced if the file, the settings or the builder differ, and left
        as it is otherwise. A network that was brought in for it stays, unless the file is another
        one or the settings name a converter.

        Parameters
        ----------
        source
            The .xodr file.
        name
            Name in the catalogue; the file's stem if not given.
        settings
            How it is converted.

        Raises
        ------
        InputError
            If the name, the spacing or the file cannot be used; names file, element and value.
        ToolError
            If netconvert cannot convert the map.
        WorkspaceError
            If the workspace cannot be written.
        """
        name = check_name(name_from_file(source) if name is None else name)
        content, file = read_map_file(source), printable(source.name)
        final = self.root / "maps" / name
        sha256 = hashlib.sha256(content).hexdigest()
        built = _read_entry(final) if (final / "map.json").is_file() else None
        same = built if built and built.sha256 == sha256 else None
        if settings.converter is None:
            settings = replace(settings, converter=same.converter if same else "odscen")
        if same and (same.conversion, same.info["builder"]) == (settings, BUILDER):
            return same
        kept = same is not None and same.converter == settings.converter == "file"
        given = same.given() if same and kept else None
        return self._built(name, content, file, settings, given, progress)

    def set_network(
        self, name: str, source: Path, *, progress: ProgressCallback | None = None
    ) -> MapEntry:
        """Make a SUMO network from outside that of a map; the lane table is made anew by geometry.

        Parameters
        ----------
        name
            Of the map.
        source
            The ``.net.xml``: the map's own after changes in netedit, or any other of this map.

        Raises
        ------
        NotFoundError
            If there is no such map.
        InputError
            If the file cannot be read, is no network, or none of this map; the map stays as it is.
        WorkspaceError
            If the workspace cannot be written.
        """
        from odscen.workspace.converters import GivenNetwork

        entry = self.map(name)
        try:
            given = GivenNetwork(source.read_bytes(), source.name)
        except OSError as error:
            raise InputError(error.strerror or str(error), file=str(source)) from error
        settings = replace(entry.conversion, converter="file")
        content = entry.path("xodr").read_bytes()
        return self._built(name, content, str(entry.info["source"]), settings, given, progress)

    def _built(
        self,
        name: str,
        content: bytes,
        file: str,
        settings: ConversionSettings,
        given: GivenNetwork | None,
        progress: ProgressCallback | None,
    ) -> MapEntry:
        from odscen.workspace.map_build import build_map

        final = self.root / "maps" / name
        with _workspace_errors(self.root), in_file(file), new_folder(final) as folder:
            build_map(
                content,
                folder,
                name=name,
                file=file,
                sha256=hashlib.sha256(content).hexdigest(),
                settings=settings,
                builder=BUILDER,
                given=given,
                progress=progress or (lambda _what, _share: None),
            )
            # Read here: another process that adds the same map may replace ours at any time.
            info = _read_entry(folder).info
        return MapEntry(name, final, info)


def _read_entry(folder: Path) -> MapEntry:
    try:
        info = json.loads((folder / "map.json").read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        msg = f"{folder / 'map.json'} cannot be read ({error}); add the map again"
        raise WorkspaceError(msg) from error
    return MapEntry(folder.name, folder, info)


@contextmanager
def _workspace_errors(root: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        msg = f"workspace {root}: {error.strerror or error} ({error.filename or ''})"
        raise WorkspaceError(msg) from error
