"""A network that odscen has not written, made usable: lane table and import report."""

from __future__ import annotations

from typing import TYPE_CHECKING

from odscen.base.errors import InputError
from odscen.convert.imported.geometric_table import geometric_table
from odscen.convert.imported.import_findings import import_findings
from odscen.convert.imported.net_import import read_network
from odscen.convert.lane_table.sumo_network import SumoNetwork
from odscen.convert.model.conversion_report import ConversionReport, parser_entries
from odscen.convert.verify.fidelity import verify

if TYPE_CHECKING:
    from collections.abc import Sequence

    from odscen.convert.model.conversion_report import ReportEntry
    from odscen.lanegraph.graphs import PedestrianGraph
    from odscen.opendrive.lanes import RoadTable
    from odscen.opendrive.road_model import OpenDrive

LEAST_SHARE = 0.05
"""Share of the driving lanes of a map that a network must have to be one of this map."""


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
    _refuse_stranger(figures, lanes.net_offset)
    report = ConversionReport.of([*parser_entries(odr.notes), *entries, *found], figures)
    return SumoNetwork(net_xml, lanes, report)


def _refuse_stranger(figures: dict[str, float], offset: tuple[float, float]) -> None:
    length = sum(figures.get(f"driving_{where}_length", 0.0) for where in ("road", "junction"))
    covered = sum(figures.get(f"driving_{where}_covered", 0.0) for where in ("road", "junction"))
    if covered < LEAST_SHARE * length:
        msg = (
            f"the SUMO network is not one of this map: its lanes lie on {covered:.0f} of "
            f"{length:.0f} m of driving lanes (netOffset {offset[0]:g},{offset[1]:g})"
        )
        raise InputError(msg)
