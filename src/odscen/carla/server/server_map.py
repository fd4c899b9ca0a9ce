"""Whether a server's map is the scenario's, and how to make it so."""

from __future__ import annotations

from typing import TYPE_CHECKING

from odscen.base.errors import CarlaError, OdscenError

if TYPE_CHECKING:
    from odscen.carla.server.carla_server import Server
    from odscen.opendrive.road_model import OpenDrive

SAME = 0.01
"""Metres that a road's length and start may differ in two files of the same map."""


def ensure_map(server: Server, name: str, xodr: str, *, load: bool = True) -> str:
    """Have the server show the map of an OpenDRIVE text.

    Parameters
    ----------
    name
        Name of the map in our catalogue, which may be the server's too.
    load
        Whether another map may be loaded: everything on the present one is gone then.

    Returns
    -------
    str
        ``there``, ``loaded`` (the server has it) or ``generated`` (a bare road surface).

    Raises
    ------
    CarlaError
        If the server shows another map and none may be loaded, or does not take ours.
    """
    if same_map(server.opendrive(), xodr):
        return "there"
    if not load:
        raise CarlaError(
            f"the CARLA server at {server.address} shows {server.map_name}, and the scenario is on "
            f"{name}; allow another map with --load-map"
        )
    if name in server.available_maps():
        server.load_map(name)
        if same_map(server.opendrive(), xodr):
            return "loaded"
    server.load_opendrive(xodr)
    if not same_map(server.opendrive(), xodr):
        raise CarlaError(
            f"the CARLA server at {server.address} did not take the OpenDRIVE text of {name}"
        )
    return "generated"


def same_map(one: str, other: str) -> bool:
    """Whether two OpenDRIVE texts are the same roads in the same places."""
    if one.split() == other.split():
        return True
    from odscen.opendrive.parse import parse

    try:
        first, second = parse(one.encode()), parse(other.encode())
    except OdscenError:
        return False
    return _same_roads(first, second)


def _same_roads(one: OpenDrive, other: OpenDrive) -> bool:
    if one.roads.keys() != other.roads.keys():
        return False
    for key, road in one.roads.items():
        twin = other.roads[key]
        a, b = road.geometry[0], twin.geometry[0]
        apart = (road.length - twin.length, a.x - b.x, a.y - b.y)
        if max(abs(value) for value in apart) > SAME:
            return False
    return True
