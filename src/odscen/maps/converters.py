"""The converters: each makes the SUMO network of a map, its lane table and its import report.

Nothing else knows which one made a map's network.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from odscen.base.errors import InputError, in_file

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from odscen.convert.lane_table.sumo_network import SumoNetwork
    from odscen.convert.model.conversion_settings import ConverterName
    from odscen.lanegraph.graphs import PedestrianGraph
    from odscen.opendrive.lanes import RoadTable
    from odscen.opendrive.road_model import OpenDrive


class GivenNetwork(NamedTuple):
    """A ``.net.xml`` that was brought in for a map, and the name of its file."""

    net_xml: bytes
    source: str


class MapInput(NamedTuple):
    """A map as converters see it: the file, the road model, its evaluation, the walks."""

    xodr: bytes
    odr: OpenDrive
    table: RoadTable
    walks: PedestrianGraph
    given: GivenNetwork | None = None


def converted(converter: ConverterName | None, source: MapInput) -> SumoNetwork:
    """Make the network of a map with the converter of that name; ``None`` is odscen.

    Raises
    ------
    InputError
        If the converter wants a given network and there is none, or one of another map.
    ToolError
        If netconvert cannot convert the map.
    """
    return CONVERTERS[converter or "odscen"](source)


def _convert_own(source: MapInput) -> SumoNetwork:
    from odscen.convert.building.network import build_network

    return build_network(source.odr, source.table, source.walks)


def _convert_by_netconvert(source: MapInput) -> SumoNetwork:
    from odscen.convert.imported.imported_network import imported_network, unread_signs
    from odscen.maps.netconvert import convert_map

    net_xml, entries = convert_map(source.xodr, lefthand=source.odr.rule == "LHT")
    entries = (*entries, *unread_signs(source.odr))
    return imported_network(net_xml, source.odr, source.table, source.walks, entries=entries)


def _use_given_network(source: MapInput) -> SumoNetwork:
    from odscen.convert.imported.imported_network import imported_network

    if source.given is None:
        raise InputError(
            "there is no network for this map; give one with: odscen maps network NAME --from"
        )
    with in_file(source.given.source):
        return imported_network(source.given.net_xml, source.odr, source.table, source.walks)


CONVERTERS: Mapping[ConverterName, Callable[[MapInput], SumoNetwork]] = {
    "odscen": _convert_own,
    "netconvert": _convert_by_netconvert,
    "file": _use_given_network,
}
