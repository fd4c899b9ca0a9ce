"""One map of the catalogue: what its folder holds, and lazy access to it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from odscen.base.errors import in_file
from odscen.convert.model.conversion_settings import ConversionSettings

if TYPE_CHECKING:
    from pathlib import Path

    import networkx as nx

    from odscen.convert.lane_table.table import LaneTable
    from odscen.convert.model.conversion_settings import ConverterName
    from odscen.convert.verify.fidelity_result import Fidelity
    from odscen.drawing.map_drawing import MapDrawing
    from odscen.lanegraph.graphs import MapGraph
    from odscen.lanegraph.map_statistics import MapStatistics
    from odscen.workspace.converters import GivenNetwork


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
        from odscen.convert.lane_table.table_json import table_from_json

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
