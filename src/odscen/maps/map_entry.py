"""One map of the catalogue: what its folder holds, and lazy access to it."""

from __future__ import annotations

import json
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from odscen.base.checksums import (
    damaged_files,
    read_checked,
    read_sums,
    refuse_damaged,
    say_unchecked,
)
from odscen.base.errors import DamagedError, DamagedFile, in_file
from odscen.convert.model.conversion_settings import ConversionSettings
from odscen.maps.importers.base import ImportSettings

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    import networkx as nx

    from odscen.convert.lane_table.table import LaneTable
    from odscen.convert.model.conversion_settings import ConverterName
    from odscen.convert.verify.fidelity_result import Fidelity
    from odscen.drawing.map_drawing import MapDrawing
    from odscen.drawing.map_sheet import Picture
    from odscen.lanegraph.graphs import MapGraph
    from odscen.lanegraph.map_statistics import MapStatistics
    from odscen.lanegraph.query import NearestNode
    from odscen.maps.converters import GivenNetwork

INFO_FILE = "map.json"
XODR_FILE = "map.xodr"


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
        return isinstance(other, MapEntry) and self._cache_key == other._cache_key

    def __repr__(self) -> str:
        """Name and place: ``info`` has tens of kilobytes."""
        return f"<Map {self.name}: {self.folder}>"

    def _repr_svg_(self) -> str:
        """Picture of the map, for notebooks."""
        return self.read("preview").decode("utf-8")

    def __hash__(self) -> int:
        """Hash of the same."""
        return hash(self._cache_key)

    @property
    def _cache_key(self) -> tuple[Path, str, float, str, str]:
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
    def source_sha256(self) -> str:
        """SHA-256 of the file that the map was added from, hexadecimal: .xodr or another format."""
        return str(self.info.get("import", {}).get("sha256", self.sha256))

    @property
    def source_key(self) -> str:
        """Key of that file in ``files`` of ``map.json``."""
        return "original" if "import" in self.info else "xodr"

    @property
    def importer(self) -> str:
        """Name of the importer that has read that file."""
        return str(self.info.get("import", {}).get("importer", "opendrive"))

    @property
    def importing(self) -> ImportSettings:
        """How it was imported."""
        record = self.info.get("import", {})
        return ImportSettings(self.importer, record.get("options", {}), record.get("edits"))

    def edit_rows(self) -> list[dict[str, Any]]:
        """Rows of the import report on the edits that mend it, in their order."""
        rows = self.info["report"]["entries"] if self.importing.edits else []
        return [row for row in rows if str(row.get("source_id")).startswith("edit ")]

    @property
    def net_sha256(self) -> str:
        """SHA-256 of its SUMO network, hexadecimal."""
        return str(self.info.get("network", {}).get("sha256", ""))

    def path(self, key: str) -> Path:
        """Absolute path of one of the files named in ``map.json``, for example ``"net"``."""
        return self.folder / str(self.info["files"][key])

    def read(self, key: str) -> bytes:
        """Content of one of its files.

        Raises
        ------
        DamagedError
            If it is not as it was written.
        """
        name = str(self.info["files"][key])
        with repair_advice(self.name):
            return read_checked(self.folder, name, self._read_checksums())

    def checked(self, key: str) -> Path:
        """Path of one of its files, for others to read; errors as of :meth:`read`."""
        name = str(self.info["files"][key])
        with repair_advice(self.name):
            if name in (sums := self._read_checksums()):
                refuse_damaged(self.folder, {name: sums[name]})
        return self.path(key)

    def damaged(self) -> list[DamagedFile]:
        """Its files that are not as they were written."""
        try:
            return damaged_files(self.folder, self._read_checksums())
        except DamagedError as error:
            return list(error.files)

    def _read_checksums(self) -> dict[str, str]:
        """Checksums of its files; of a map by an earlier version only those it knows itself."""
        sums = read_sums(self.folder)
        if sums is None:
            say_unchecked(self.folder)
            files = self.info["files"]
            known = {files["xodr"]: self.sha256, files["net"]: self.net_sha256}
            return {name: value for name, value in known.items() if value}
        return sums

    def graph(self) -> MapGraph:
        """Lane graph, segments and pedestrian graph."""
        from odscen.lanegraph.graph_files import from_npz_bytes

        return from_npz_bytes(self.read("graph_npz"))

    def nearest(self, x: float, y: float, hdg: float | None = None) -> NearestNode:
        """Find the node of the lane graph nearest to a place, for spawns and goals.

        Parameters
        ----------
        x, y
            Metres in the OpenDRIVE frame.
        hdg
            Direction of driving, rad counter-clockwise from x: only lanes within 45 degrees of it.

        Returns
        -------
        NearestNode
            ``id``, ``x``, ``y``, ``z``, ``hdg`` and ``distance`` (m).

        Raises
        ------
        InputError
            If a number is not finite, or the map has no lane in that direction.
        """
        from odscen.lanegraph.query import nearest_node

        return nearest_node(self.graph(), x, y, hdg)

    def plot(self, *, graph: bool = False, segments: bool = False) -> Picture:
        """Draw the map, with legend and scale.

        Parameters
        ----------
        graph
            With lane graph and pedestrian graph.
        segments
            With the segments, in alternating colours.

        Returns
        -------
        Picture
            Shown by notebooks; ``save`` writes it.

        Raises
        ------
        DamagedError
            If a file of the map is not as it was written.
        """
        from odscen.drawing.legend import RenderOptions
        from odscen.drawing.map_sheet import Picture, render_drawing

        options = RenderOptions(graph=graph, segments=segments)
        shown = self.graph() if graph or segments else None
        return Picture(
            render_drawing(
                self.drawing(), statistics=self.statistics(), graph=shown, options=options
            )
        )

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
        from odscen.maps.converters import GivenNetwork

        return GivenNetwork(self.read("net"), str(self.info["network"]["source"]))

    def lane_table(self) -> LaneTable:
        """The table between OpenDRIVE lanes and SUMO lanes."""
        from odscen.convert.lane_table.table_json import table_from_json

        return table_from_json(self.read("lane_table"))

    def drawing(self) -> MapDrawing:
        """What is drawn of the map."""
        from odscen.drawing.map_drawing import MapDrawing

        return MapDrawing.from_json(self.read("drawing"))

    def fidelity(self) -> Fidelity:
        """How faithfully the SUMO network follows the map, measured from both files anew."""
        from odscen.convert.verify.fidelity import verify
        from odscen.opendrive.lanes import RoadTable
        from odscen.opendrive.parse import parse

        odr = parse(self.read("xodr"), file=self.path("xodr").name)
        with in_file(self.path("net").name):
            # One that was brought in may state another offset than the map's; one of ours must not.
            offset = self.lane_table().net_offset if self.converter == "file" else None
            return verify(self.read("net"), odr, RoadTable.of(odr), offset=offset)

    def statistics(self) -> MapStatistics:
        """Figures of the map."""
        from odscen.lanegraph.map_statistics import MapStatistics

        values = self.info["statistics"]
        return MapStatistics(**{**values, "bounds": tuple(values["bounds"])})


@dataclass(frozen=True, slots=True)
class BrokenMap:
    """A map of the catalogue that cannot be used: its name, and why."""

    name: str
    problem: str


_NEEDED = {"sha256": str, "spacing": int | float, "builder": str, "files": dict, "statistics": dict}
"""Fields of ``map.json`` without which nothing else can be said of a map, and their types."""


def read_entry(folder: Path) -> MapEntry:
    """Read what ``map.json`` says of a map.

    Raises
    ------
    DamagedError
        If it cannot be believed.
    """
    with repair_advice(folder.name):
        content = read_checked(folder, INFO_FILE, read_sums(folder))
        try:
            info = json.loads(content)
            if all(isinstance(info[key], kind) for key, kind in _NEEDED.items()):
                return MapEntry(folder.name, folder, info)
            problem = "something else"
        except (ValueError, KeyError, TypeError, RecursionError) as error:
            problem = f"{type(error).__name__}: {error}"
        wrong = DamagedFile(INFO_FILE, "what is said of a map", problem)
        raise DamagedError(str(folder), [wrong])


@contextmanager
def repair_advice(name: str) -> Iterator[None]:
    """Add to what is found damaged in a map how to get it back.

    Raises
    ------
    DamagedError
        The same, with advice.
    """
    try:
        yield
    except DamagedError as error:
        raise DamagedError(
            str(error.file),
            error.files,
            advice=f"odscen doctor --repair builds map {name!r} anew, as does adding it again",
        ) from error
