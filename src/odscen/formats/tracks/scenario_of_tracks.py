"""A scenario out of recorded traffic: each road user an actor that follows its track, or drives."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np
import polars as pl

from odscen.base.categories import DEFAULT_BODY, Body, Category
from odscen.base.errors import InputError
from odscen.formats.tracks.lane_places import LaneFinder
from odscen.formats.tracks.recorded_traffic import trajectory_rows
from odscen.lanegraph.query import node_id, walk_node_id
from odscen.lanegraph.shortest_paths import Router
from odscen.scenario.document.problems import validated
from odscen.scenario.document.scenario_document import Scenario

if TYPE_CHECKING:
    from collections.abc import Sequence

    from odscen.base.arrays import IntArray
    from odscen.formats.base import ElementReport, ImportMap
    from odscen.formats.tracks.recorded_traffic import RecordedTraffic
    from odscen.lanegraph.graphs import Segments
    from odscen.scenario.document.rules_document import TrajectoryRow
    from odscen.simulators.assets import Assets

MOST_USERS: Final = 2000
_SHORTEST_STEP, _LONGEST_STEP = 0.01, 0.1
_NEAR_LANE: Final = 30.0
"""Metres from its first place within which a road user needs a lane, or walk, to be placed on."""
_CLOSE: Final = {"ttc": 3.0, "metres": 6.0}
"""Time to collision with the ego, and distance between the bodies, from which on it reacts."""
_DESIRED: Final = 0.95
"""Quantile of the speeds of a track that its driver's desired speed is taken from."""
_TAIL: Final = 1.0
"""Seconds that the run lasts beyond the window."""


@dataclass(frozen=True, slots=True)
class SceneChoice:
    """What a scenario is to be made of a recording.

    Attributes
    ----------
    ego
        Id in the recording; it is free for SUMO, CARLA or a driver of one's own. None if empty.
    follow
        What the others do: ``track`` follows its track exactly; ``react`` follows it until it would
        collide with the ego, or touches nearly, and then drives itself; ``drive`` drives from the
        start, at the desired speed of its track.
    """

    ego: str = ""
    follow: str = "track"


def scenario_of_tracks(
    recorded: RecordedTraffic,
    the_map: ImportMap,
    choice: SceneChoice,
    *,
    name: str,
    assets: Assets,
    report: ElementReport,
) -> Scenario:
    """Scenario of a recording whose places are those of the map.

    Parameters
    ----------
    assets
        Of the models, each vehicle gets the one of its category whose size is nearest to its own.
    report
        Hears who became an actor, and who did not, and why.

    Raises
    ------
    InputError
        If the ego is not in it, nobody is near a lane, or there are too many road users.
    """
    rows = recorded.rows
    users = rows.filter(pl.col("category").is_not_null()).group_by("id").agg(
        pl.col("time").min().alias("begin"),
        pl.col("time").len().alias("frames"),
        pl.col("category").first().cast(pl.String),
    ).sort("begin", "id")  # fmt: skip
    if choice.ego and choice.ego not in set(users["id"]):
        listed = ", ".join(sorted(users["id"])[:12])
        raise InputError(f"there is no road user {choice.ego!r} in the window; there are {listed}")
    if users.height > MOST_USERS:
        raise InputError(
            f"{users.height} road users are more than {MOST_USERS}; choose a part of the recording "
            "with --window"
        )
    step = min(max(round(recorded.step, 3), _SHORTEST_STEP), _LONGEST_STEP)
    placing, graph = _Placing(the_map), the_map.sumo_map.graph
    names = _actor_names(users["id"].to_list())
    # Who appears does so one step later at the earliest; all are later by the same time.
    first = float(rows["time"].min())  # type: ignore[arg-type]
    later = step - first
    placed: dict[str, _Placed] = {}
    for user, category in users.select("id", "category").iter_rows():
        own = rows.filter(pl.col("id") == user)
        if own.height < 2:
            report.add("ignored", f"road user {user}", "it has one row only")
            continue
        place = placing.place_actor(own, Category(category))
        if place is None:
            where = "walk" if category == Category.PEDESTRIAN else "lane"
            report.add("refused", f"road user {user}", f"no {where} within {_NEAR_LANE:g} m of it")
        else:
            placed[user] = _Placed(own, Category(category), place.segment, place.fields)
    if not placed:
        raise InputError("no road user of the window is near a lane or walk of the map")
    region = _largest_piece(graph.segments, [found.segment for found in placed.values()])
    actors, rules = [], []
    for user, found in placed.items():
        if found.segment not in region:
            reason = "the map is in several pieces, and the others drive in another one"
            report.add("refused", f"road user {user}", reason)
            continue
        is_ego = user == choice.ego
        made = found.fields | {"id": names[user], "category": found.category, "ego": is_ego}
        model = _model_of_size(found.own, found.category, assets)
        if model is not None:
            made["model"] = model
        begin, track = trajectory_rows(found.own, of=user)
        if is_ego or (choice.follow == "drive" and found.category != Category.PEDESTRIAN):
            made |= _fit_driving(found.own, begin + later)
        else:
            made["depart"] = round(begin + later, 6)
            rules += _rules_of(names[user], track, begin + later - step, found.own, choice, names)
        actors.append(made)
        report.add("taken", f"road user {user}", f"actor {names[user]}")
    last = float(rows["time"].max())  # type: ignore[arg-type]
    return validated(
        Scenario,
        {
            "name": name,
            "description": f"Recorded traffic ({recorded.schema}), from {first:g} to {last:g} s of "
            f"the recording; the time of the run is that of the recording plus {later:g} s.",
            "map": {
                "name": the_map.name,
                "sha256": the_map.sha256,
                "spacing": graph.lanes.spacing,
            },
            "roi": [graph.segments.ids[row] for row in sorted(region)],
            "simulation": {
                "duration": round(last + later + _TAIL, 3),
                "step_length": step,
                "teleport_after": 0,
                "after_story": "never",
            },
            "actors": actors,
            "rules": rules,
        },
    )


def _body_width(own: pl.DataFrame, category: Category) -> float:
    return float(own["width"].drop_nulls().median() or DEFAULT_BODY[category].width)  # type: ignore[arg-type]


def _model_of_size(own: pl.DataFrame, category: Category, assets: Assets) -> str | None:
    """The model nearest in length and width; none where the file has no size, or for who walks."""
    length, width = (own[name].drop_nulls().median() for name in ("length", "width"))
    if category == Category.PEDESTRIAN or length is None or width is None:
        return None
    usual = DEFAULT_BODY[category]

    def misfit(body: Body) -> float:
        return math.hypot(body.length - float(length), body.width - float(width))  # type: ignore[arg-type]

    models = sorted(assets.of_category(category), key=lambda model: (misfit(model.body), model.id))
    if not models or misfit(usual) <= misfit(models[0].body):
        return None
    return models[0].id


def _actor_names(users: list[str]) -> dict[str, str]:
    """Ids that a document may have, one for each road user, those of the file where it can."""
    names: dict[str, str] = {}
    taken: set[str] = set()
    for user in users:
        plain = re.sub(r"[^A-Za-z0-9_.-]+", "-", user).strip("-._")[:40] or "user"
        found, k = plain, 2
        while found in taken:
            found, k = f"{plain}-{k}", k + 1
        names[user] = found
        taken.add(found)
    return names


class _Place(NamedTuple):
    """Segment on which an actor begins, and fields of the document that place it."""

    segment: int
    fields: dict[str, Any]


class _Placed(NamedTuple):
    own: pl.DataFrame
    category: Category
    segment: int
    fields: dict[str, Any]


def _largest_piece(segments: Segments, begins: Sequence[int]) -> set[int]:
    """Rows of connected segments, of the pieces of the map that on which most road users begin."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    total, pairs = len(segments.ids), segments.adjacency.reshape(-1, 2)
    links = coo_matrix((np.ones(len(pairs)), pairs.T), shape=(total, total))
    piece = connected_components(links, directed=False)[1]
    most = np.bincount(piece[np.asarray(begins)]).argmax()
    return set(np.flatnonzero(piece == most).tolist())


class _Placing:
    """Where road users are placed on the lane graph, and where they go."""

    def __init__(self, the_map: ImportMap) -> None:
        from odscen.sumo.realize.usable import usable_places

        self._map = the_map.sumo_map.graph
        usable = usable_places(the_map.sumo_map)
        lanes, walks = self._map.lanes, self._map.walks
        inside, starts, walked = usable.in_junction, usable.spawnable, usable.walkable
        if inside is None or starts is None or walked is None:
            raise InputError(f"map {the_map.name!r} has no lanes that SUMO can use")
        self._starts = np.flatnonzero(starts & ~inside)
        self._drivable = np.flatnonzero(the_map.sumo_map.drivable & ~inside)
        self._walkable = np.flatnonzero(walked)
        self._lanes = np.column_stack([lanes.x, lanes.y, lanes.hdg])
        self._walks = np.column_stack([walks.x, walks.y])
        self._router = Router(self._map, usable.drivable)
        self._taken: tuple[set[int], set[int]] = set(), set()
        self._finder = LaneFinder(self._map)

    def place_actor(self, own: pl.DataFrame, category: Category) -> _Place | None:
        """Spawn, goal and what else places an actor; ``None`` if nothing is near.

        Each has a node of its own, as the document wants: who comes into view where another one
        did has the next.
        """
        first, last = (own.row(k, named=True) for k in (0, -1))
        if category == Category.PEDESTRIAN:
            spawn = self._near_walk(first)
            if spawn is None:
                return None
            self._taken[1].add(spawn)
            segment = int(self._map.walks.segment[spawn])
            return _Place(segment, {"spawn": str(walk_node_id(self._map, spawn))})
        start = self._near_lane(self._starts, first, free=True)
        if start is None:
            return None
        self._taken[0].add(start)
        made: dict[str, Any] = {"spawn": str(node_id(self._map, start))}
        made |= self._route_along(start, last)
        place = self._finder.locate(*(np.array([first[name]]) for name in ("x", "y", "hdg")))
        room = max(float(place.width[0]) - _body_width(own, category), 0.0) / 2.0
        made["lateral_offset"] = round(float(np.clip(place.lateral[0], -room, room)), 2)
        return _Place(int(self._map.lanes.segment[start]), made)

    def _route_along(self, start: int, last: dict[str, Any]) -> dict[str, Any]:
        """The end of the region that is nearest beyond the last place, by way of that."""
        ends = self._router.goal_candidates(start)
        reachable = self._router.reachable(start)
        seen = self._near_lane(self._drivable[reachable[self._drivable]], last)
        if seen is None or not len(ends):
            return {}
        beyond = self._router.distances(seen)[ends]
        if not np.isfinite(beyond).any():
            return {"goal": str(node_id(self._map, seen))} if seen != start else {}
        goal = int(ends[np.argmin(beyond)])
        made: dict[str, Any] = {"goal": str(node_id(self._map, goal))}
        there = self._router.distance(start, seen) + float(beyond.min())
        if seen not in (start, goal) and there > self._router.distance(start, goal) + 1.0:
            made["via"] = [str(node_id(self._map, seen))]
        return made

    def _near_walk(self, state: dict[str, Any]) -> int | None:
        away = np.hypot(*(self._walks[self._walkable] - (state["x"], state["y"])).T)
        for k in np.argsort(away, kind="stable")[: len(self._taken[1]) + 1].tolist():
            if away[k] <= _NEAR_LANE and int(self._walkable[k]) not in self._taken[1]:
                return int(self._walkable[k])
        return None

    def _near_lane(
        self, nodes: IntArray, state: dict[str, Any], *, free: bool = False
    ) -> int | None:
        """The nearest of some nodes, perhaps one on which no other actor starts.

        One that leads elsewhere counts as farther away.
        """
        x, y, hdg = self._lanes[nodes].T
        away = np.hypot(x - state["x"], y - state["y"])
        cost = away + 5.0 * (1.0 - np.cos(hdg - state["hdg"]))
        taken = self._taken[0] if free else set()
        for k in np.argsort(cost, kind="stable")[: len(taken) + 1].tolist():
            if int(nodes[k]) not in taken:
                return int(nodes[k]) if away[k] <= _NEAR_LANE else None
        return None


def _fit_driving(own: pl.DataFrame, depart: float) -> dict[str, Any]:
    """Departure and desired speed of a driver who drives as its track shows."""
    speeds = own["speed"]
    return {
        "depart": round(depart, 6),
        "initial_speed": round(min(float(speeds[0]), 100.0), 3),
        "speed": round(min(max(float(speeds.quantile(_DESIRED) or 0.0), 1.0), 100.0), 3),
    }


def _rules_of(
    actor: str,
    track: tuple[TrajectoryRow, ...],
    after: float,
    own: pl.DataFrame,
    choice: SceneChoice,
    names: dict[str, str],
) -> list[dict[str, Any]]:
    """Rules by which an actor appears, follows its track, and vanishes where that ends."""
    (_, x, y, hdg), speed = track[0], min(float(own["speed"][0]), 100.0)
    follows = {
        "id": f"track-{actor}",
        "actor": actor,
        "when": {"time": {"after": round(max(after, 0.0), 6)}},
        "then": [
            {"appear": {"at": [x, y, hdg], "speed": round(speed, 3)}},
            {"replay": {"rows": track}},
            {"vanish": {}},
        ],
    }
    # SUMO's pedestrians heed no vehicle, and do not find back to a walk from everywhere.
    reacts_to_ego = choice.follow == "react" and own["category"][0] != Category.PEDESTRIAN
    if not (reacts_to_ego and choice.ego):
        return [follows]
    ego = names[choice.ego]
    near = [
        {"distance": {"of": actor, "to": ego, "below": _CLOSE["metres"]}},
        {"ttc": {"of": actor, "to": ego, "below": _CLOSE["ttc"]}},
    ]
    reacts = {
        "id": f"react-{actor}",
        "actor": actor,
        "when": {"any": near},
        "then": [{"release": {}}],
    }
    return [follows, reacts]
