"""Traffic lights of a SUMO network against those of its map, and greens that conflict."""

from __future__ import annotations

from collections import defaultdict
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np

from odscen.convert.verify.fidelity_result import NEAR, SignalCoverage, UnsafePair
from odscen.convert.verify.polyline_finder import Polylines
from odscen.opendrive.objects import signal_kind

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from odscen.convert.verify.net_reader import NetFile, NetFileJunction, NetFileLink
    from odscen.convert.verify.polyline_finder import Finder
    from odscen.opendrive.road_model import OpenDrive

_MIDDLE_STEP = 1.0


def compare_signals(
    net: NetFile, odr: OpenDrive, drivable: Finder, junction_of: Sequence[str | None]
) -> SignalCoverage:
    """Compare which junctions have traffic lights.

    Parameters
    ----------
    drivable, junction_of
        Pieces of the map's drivable lanes, and the junction of each owner of a piece.
    """
    lit = lit_junctions(odr)
    controlled, elsewhere = _controlled_junctions(net, drivable, junction_of)
    return SignalCoverage(
        opendrive=len(lit),
        sumo=sum(bool(links) for links in _controlled_links(net).values()),
        lost=tuple(junction for junction in lit if junction not in controlled),
        invented=tuple(name for name, found in elsewhere.items() if not found & set(lit)),
    )


def lit_junctions(odr: OpenDrive) -> tuple[str, ...]:
    """Junctions with a controller of lights, or with a dynamic traffic light on a connecting road.

    CARLA gives controllers to signs that say "give way", too: a controller counts unless the file
    has all the signals it rules and none of them is a light.
    """
    signals = [signal for road in odr.roads.values() for signal in road.signals]
    lights = {s.id for s in signals if s.dynamic and signal_kind(s) == "traffic_light"}
    others = {s.id for s in signals if signal_kind(s) not in ("traffic_light", "pedestrian_light")}
    of_signs = {
        controller.id
        for controller in odr.controllers.values()
        if controller.controls and all(signal in others for signal, _ in controller.controls)
    }
    lit = {
        road.junction
        for road in odr.roads.values()
        if any(signal.id in lights for signal in road.signals)
        or any(reference.id in lights for reference in road.signal_references)
    }
    return tuple(
        junction.id
        for junction in odr.junctions.values()
        if junction.id in lit or not of_signs.issuperset(junction.controllers)
    )


def _controlled_links(net: NetFile) -> dict[str, list[NetFileLink]]:
    """Links that a traffic light rules, by SUMO junction."""
    programs = {program.tl for program in net.programs}
    return {
        junction: [link for link in links if link.tl in programs]
        for junction, links in net.request_rows().items()
    }


def _controlled_junctions(
    net: NetFile, drivable: Finder, junction_of: Sequence[str | None]
) -> tuple[set[str], dict[str, set[str]]]:
    """Junctions of the map that SUMO's lights control: all of them, and by SUMO junction."""
    names, shapes = [], []
    by_sumo: dict[str, set[str]] = {}
    for name, links in _controlled_links(net).items():
        driven = [link for link in links if link.via]
        if links:
            by_sumo[name] = set()
        names += [name] * len(driven)
        shapes += [net.lanes[link.via].shape for link in driven]
    places = Polylines.of(shapes).cut(_MIDDLE_STEP)
    _, row = drivable.nearest(places, 4.0 * NEAR)
    for owner, piece in zip(places.owner[row >= 0].tolist(), row[row >= 0].tolist(), strict=True):
        junction = junction_of[int(drivable.pieces.owner[piece])]
        if junction is not None:
            by_sumo[names[owner]].add(junction)
    return set().union(*by_sumo.values()), by_sumo


def unsafe_pairs(net: NetFile) -> tuple[UnsafePair, ...]:
    """Pairs of links that conflict and have green together without one of them giving way.

    One gives way if its green is ``g`` and its request says that it yields to the other.
    """
    rows = net.request_rows()
    return tuple(
        pair for junction in net.junctions for pair in _unsafe_at(net, junction, rows[junction.id])
    )


def _unsafe_at(
    net: NetFile, junction: NetFileJunction, links: list[NetFileLink]
) -> Iterator[UnsafePair]:
    controlled: dict[str, list[int]] = defaultdict(list)
    for row, link in enumerate(links):
        if link.tl:
            controlled[link.tl].append(row)
    for program in net.programs:
        for a, b in combinations(controlled.get(program.tl, ()), 2):
            if b not in junction.foes.get(a, ()) and a not in junction.foes.get(b, ()):
                continue
            indices = (links[a].link_index, links[b].link_index)
            for phase, state in enumerate(program.states):
                one, other = (state[index : index + 1] for index in indices)
                if not {one, other} <= {"G", "g"}:
                    continue
                waits = one == "g" and b in junction.yields.get(a, ())
                if not waits and not (other == "g" and a in junction.yields.get(b, ())):
                    x, y = _middle(net, links[a], links[b])
                    yield UnsafePair(program.tl, phase, indices, "g" in (one, other), x, y)


def _middle(net: NetFile, *links: NetFileLink) -> tuple[float, float]:
    """Where two links meet, about: the middle between their lanes."""
    shapes = [net.lanes[link.via or link.target].shape for link in links]
    x, y = np.mean(
        [0.5 * (shape.min(axis=0) + shape.max(axis=0)) for shape in shapes], axis=0
    ).tolist()
    return x, y
