"""A network that odscen has not written, made usable: lane table and import report."""

from __future__ import annotations

from typing import TYPE_CHECKING

from odscen.base.errors import InputError
from odscen.convert.imported.geometric_table import geometric_table
from odscen.convert.imported.import_findings import import_findings
from odscen.convert.imported.net_import import read_network
from odscen.convert.lane_table.sumo_network import SumoNetwork
from odscen.convert.model.conversion_report import ConversionReport, parser_entries
from odscen.convert.model.net import NORMAL
from odscen.convert.verify.fidelity import verify

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from odscen.convert.lane_table.table import LaneTable
    from odscen.convert.model.conversion_report import ReportEntry
    from odscen.lanegraph.graphs import PedestrianGraph
    from odscen.opendrive.lanes import RoadTable
    from odscen.opendrive.road_model import OpenDrive

LEAST_COVERED = 0.05
"""Share of the driving lanes of a map that a network must have to be one of this map."""

LEAST_PLACED = 0.5
"""Share of the network's lanes outside junctions that must lie on lanes of the map."""


def imported_network(
    net_xml: bytes,
    odr: OpenDrive,
    table: RoadTable,
    walks: PedestrianGraph,
    *,
    entries: Sequence[ReportEntry] = (),
) -> SumoNetwork:
    """Relate a network to its map.

    Parameters
    ----------
    net_xml
        Text of a ``.net.xml``; taken as it is.
    odr, table, walks
        The road model, its evaluation, and the pedestrian graph of the map.
    entries
        What is known already of how the network came about.

    Raises
    ------
    InputError
        If it is no network, or none of this map.
    """
    lanes = geometric_table(read_network(net_xml), odr, table, walks)
    fidelity = verify(net_xml, odr, table)
    found, figures = import_findings(odr, table, lanes, fidelity)
    _refuse_stranger(figures, lanes)
    report = ConversionReport.of([*parser_entries(odr.notes), *entries, *found], figures)
    return SumoNetwork(net_xml, lanes, report)


def _refuse_stranger(figures: Mapping[str, float], lanes: LaneTable) -> None:
    length = sum(figures.get(f"driving_{where}_length", 0.0) for where in ("road", "junction"))
    covered = sum(figures.get(f"driving_{where}_covered", 0.0) for where in ("road", "junction"))
    own = {
        row: lane.length
        for row, lane in enumerate(lanes.lane_list)
        if lanes.edges[lane.edge].function == NORMAL and lane.allowed != frozenset()
    }
    placed = sum(
        float(interval.pos[-1] - interval.pos[0])
        for interval in lanes.intervals
        if interval.sumo in own
    )
    if covered < LEAST_COVERED * length or placed < LEAST_PLACED * sum(own.values()):
        x, y = lanes.net_offset
        raise InputError(
            f"the SUMO network is not one of this map: {placed:.0f} of {sum(own.values()):.0f} m "
            f"of its lanes lie on lanes of the map, on {covered:.0f} of {length:.0f} m of driving "
            f"lanes (netOffset {x:g},{y:g})"
        )
