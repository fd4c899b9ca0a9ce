"""Scenes of all kinds are those that a second, plain search finds, and no others.

The search here shares nothing with that of odscen: it goes through rows and pairs one by one.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
import pytest
import shapely

import odscen
from odscen.formats.tracks.lane_places import fit_on_map
from odscen.formats.tracks.recorded_traffic import complete_tracks
from odscen.formats.tracks.scenes import find_scenes
from odscen.scenario import edits
from odscen.scenario.demand.inflow import entries
from odscen.scenario.placing.region import Region

ROOT = Path(__file__).parents[3]
Scene = tuple[str, str, str | None, float, float]
Rows = list[dict[str, Any]]


def joined(kind: str, frames: dict[tuple[str, str | None], list[float]]) -> Iterator[Scene]:
    """Frames of the same road users less than 1 s apart are one scene."""
    for (user, other), times in frames.items():
        ordered = sorted(times)
        begin = ordered[0]
        for before, after in pairwise([*ordered, math.inf]):
            if after - before > 1.0:
                yield kind, user, other, begin, before
                begin = after


def by_time(rows: Rows) -> dict[int, Rows]:
    frames: dict[int, Rows] = {}
    for row in rows:
        frames.setdefault(round(row["time"] * 1000), []).append(row)
    return frames


def by_user(rows: Rows) -> dict[str, Rows]:
    users: dict[str, Rows] = {}
    for row in rows:
        users.setdefault(row["id"], []).append(row)
    for own in users.values():
        own.sort(key=lambda row: row["time"])
    return users


def braking(vehicles: Rows) -> Iterator[Scene]:
    frames: dict[tuple[str, str | None], list[float]] = {}
    for row in vehicles:
        if row["acceleration"] <= -4.5:
            frames.setdefault((row["id"], None), []).append(row["time"])
    yield from joined("hard_braking", frames)


def time_to_collision(a: dict[str, Any], b: dict[str, Any]) -> float:
    """Until a touches b ahead in its path, as both go on."""
    ahead = (b["x"] - a["x"]) * math.cos(a["hdg"]) + (b["y"] - a["y"]) * math.sin(a["hdg"])
    aside = (b["y"] - a["y"]) * math.cos(a["hdg"]) - (b["x"] - a["x"]) * math.sin(a["hdg"])
    corners = [
        (
            sx * b["length"] / 2 * math.cos(b["hdg"] - a["hdg"])
            - sy * b["width"] / 2 * math.sin(b["hdg"] - a["hdg"]),
            sx * b["length"] / 2 * math.sin(b["hdg"] - a["hdg"])
            + sy * b["width"] / 2 * math.cos(b["hdg"] - a["hdg"]),
        )
        for sx in (-1, 1)
        for sy in (-1, 1)
    ]
    along, across = max(x for x, _ in corners), max(y for _, y in corners)
    if not 0 < ahead < 150.0 or abs(aside) >= a["width"] / 2 + across:
        return math.inf
    closing = a["speed"] - b["speed"] * math.cos(b["hdg"] - a["hdg"])
    gap = max(ahead - a["length"] / 2 - along, 0.0)
    return gap / closing if closing > 1e-3 else math.inf


def short_ttc(vehicles: Rows) -> Iterator[Scene]:
    frames: dict[tuple[str, str | None], list[float]] = {}
    for states in by_time(vehicles).values():
        for a in states:
            for b in states:
                if a is not b and time_to_collision(a, b) < 2.0:
                    frames.setdefault((a["id"], b["id"]), []).append(a["time"])
    yield from joined("short_ttc", frames)


def neighbours(one: str, other: str) -> bool:
    """Whether lanes road.section.lane lie side by side in one direction; all of them driven."""
    a, b = one.split("."), other.split(".")
    return a[:-1] == b[:-1] and abs(int(a[-1]) - int(b[-1])) == 1 and int(a[-1]) * int(b[-1]) > 0


def changes_of_lane(vehicles: Rows) -> Iterator[tuple[Scene, dict[str, Any]]]:
    for user, rows in by_user([row for row in vehicles if row["on_lane"]]).items():
        for k, (before, after) in enumerate(pairwise(rows)):
            if before["lane"] == after["lane"] or not neighbours(before["lane"], after["lane"]):
                continue
            soon = [row for row in rows[k + 1 :] if row["time"] <= after["time"] + 1.0]
            lately = [row for row in rows[: k + 1] if row["time"] >= before["time"] - 1.0]
            if any(row["lane"] == before["lane"] for row in soon):
                continue
            if any(row["lane"] == after["lane"] for row in lately):
                continue
            yield ("lane_change", user, None, before["time"], after["time"]), after


def cut_ins(vehicles: Rows) -> Iterator[Scene]:
    frames = by_time(vehicles)
    for (_, user, _, begin, end), own in changes_of_lane(vehicles):
        near = []
        for other in frames[round(end * 1000)]:
            if other["id"] == user or not other["on_lane"] or other["lane"] != own["lane"]:
                continue
            c, s = math.cos(other["hdg"]), math.sin(other["hdg"])
            behind = (own["x"] - other["x"]) * c + (own["y"] - other["y"]) * s
            gap = behind - (own["length"] + other["length"]) / 2
            if behind > 0 and gap < 2.0 * other["speed"]:
                near.append((max(gap, 0.0) / other["speed"], other["id"]))
        if near:
            yield "cut_in", user, min(near)[1], begin, end


def time_at(rows: Rows, x: float, y: float) -> float:
    """When a track passes a place on it, between its rows."""
    best = (math.inf, 0.0)
    for a, b in pairwise(rows):
        dx, dy = b["x"] - a["x"], b["y"] - a["y"]
        length = dx * dx + dy * dy
        share = 0.0 if length == 0 else ((x - a["x"]) * dx + (y - a["y"]) * dy) / length
        share = min(max(share, 0.0), 1.0)
        away = math.hypot(a["x"] + share * dx - x, a["y"] + share * dy - y)
        if away < best[0] - 1e-9:
            best = away, a["time"] + share * (b["time"] - a["time"])
    return best[1]


def line(rows: Rows) -> shapely.LineString:
    return shapely.LineString([(row["x"], row["y"]) for row in rows])


def crossing_times(a: Rows, b: Rows) -> list[tuple[float, float]]:
    """When each of two is where their tracks cross."""
    if len(a) < 2 or len(b) < 2:
        return []
    met = line(a).intersection(line(b))
    parts = getattr(met, "geoms", [met])
    points = [part for part in parts if part.geom_type == "Point"]
    return [(time_at(a, p.x, p.y), time_at(b, p.x, p.y)) for p in points]


def pedestrians_and_vehicles(walkers: Rows, vehicles: Rows) -> Iterator[Scene]:
    for walker, own in by_user(walkers).items():
        for vehicle, other in by_user(vehicles).items():
            times = [pair for pair in crossing_times(own, other) if abs(pair[0] - pair[1]) <= 5.0]
            if times:
                first = min(times)
                yield "crossing_pedestrian", walker, vehicle, min(first), max(first)


def turned(rows: Rows) -> float:
    """Heading from first to last row, degrees to the left."""
    total = 0.0
    for a, b in pairwise(rows):
        total += math.remainder(b["hdg"] - a["hdg"], math.tau)
    return math.degrees(total)


def turns_across(vehicles: Rows, roads: set[str]) -> Iterator[Scene]:
    """Turns in junctions across the path of who comes from the opposite side."""
    inside: dict[str, list[Rows]] = {}
    for user, rows in by_user(vehicles).items():
        passage: Rows = []
        for row in [*rows, None]:
            if row is not None and row["on_lane"] and row["lane"].split(".")[0] in roads:
                passage.append(row)
            elif passage:
                inside.setdefault(user, []).append(passage)
                passage = []
    for user, passages in inside.items():
        for own in passages:
            if abs(turned(own)) <= 45.0:
                continue
            for other, others in inside.items():
                for theirs in others:
                    facing = math.degrees(
                        abs(math.remainder(theirs[0]["hdg"] - own[0]["hdg"], math.tau))
                    )
                    if other == user or facing <= 135.0 or abs(turned(theirs)) > 45.0:
                        continue
                    times = [
                        pair for pair in crossing_times(own, theirs) if abs(pair[0] - pair[1]) <= 5
                    ]
                    if times:
                        yield "unprotected_left", user, other, *sorted(min(times))


def independent_scenes(placed: pl.DataFrame, junction_roads: set[str]) -> set[Scene]:
    rows = placed.filter(pl.col("category").is_not_null()).to_dicts()
    walkers = [row for row in rows if row["category"] == "pedestrian"]
    vehicles = [row for row in rows if row["category"] != "pedestrian"]
    return {
        *braking(vehicles),
        *short_ttc(vehicles),
        *(scene for scene, _ in changes_of_lane(vehicles)),
        *cut_ins(vehicles),
        *pedestrians_and_vehicles(walkers, vehicles),
        *turns_across(vehicles, junction_roads),
    }


def run_traffic(
    workspace: odscen.Workspace, map_name: str, out: Path, *, per_hour: float, seconds: float
) -> pl.DataFrame:
    """Tracks of the shipped scenario of a map, and of traffic from all entries."""
    scenario_file = ROOT / "suites" / "scenarios" / f"{map_name}.scenario.json"
    scenario = odscen.read_scenario(scenario_file)
    graph = workspace.map(map_name).graph()
    scenario = edits.set_simulation(scenario, duration=seconds, step_length=0.2)
    for number, place in enumerate(entries(Region.of(graph, scenario.roi))):
        scenario = edits.set_input(
            scenario, graph, inflow=f"leg-{number}", segment=place.segment,
            direction=place.direction, per_hour=per_hour,
        )  # fmt: skip
    run = odscen.run(workspace, scenario, out=out)
    return odscen.read_recorded_traffic(run.folder).rows


@pytest.mark.slow
@pytest.mark.parametrize(
    ("map_name", "per_hour", "seconds"),
    [("signal_crossing", 350.0, 150.0), ("t_junction_signs", 350.0, 150.0),
     ("motorway_weave", 500.0, 60.0)],
)  # fmt: skip
def test_scenes_of_runs_are_those_of_a_plain_search(
    tmp_path: Path, map_name: str, per_hour: float, seconds: float
) -> None:
    workspace = odscen.Workspace.open(tmp_path / "workspace")
    workspace.add_map(ROOT / "maps" / f"{map_name}.xodr")
    rows = run_traffic(workspace, map_name, tmp_path / "run", per_hour=per_hour, seconds=seconds)
    graph = workspace.map(map_name).graph()
    # As a sensor would have it: places and speeds a little wrong, so that nothing is at a bound.
    rng = np.random.default_rng(6)
    rows = rows.with_columns(
        pl.col("acceleration") * pl.Series(rng.normal(1.6, 0.2, rows.height)),
        *(pl.col(name) + pl.Series(rng.normal(0.0, 1e-3, rows.height)) for name in ("x", "y")),
    )
    placed, _ = fit_on_map(rows, graph)
    lanes = graph.lanes.lanes
    roads = {
        str(key).split(".")[0]
        for key, junction in zip(lanes.keys, lanes.junctions, strict=True)
        if junction is not None
    }
    wanted = independent_scenes(placed, roads)
    found = find_scenes(placed, graph)
    kinds = {kind for kind, *_ in wanted}
    assert len(wanted) > 20
    assert (
        kinds
        >= {
            "signal_crossing": {
                "hard_braking",
                "short_ttc",
                "unprotected_left",
                "crossing_pedestrian",
            },
            "t_junction_signs": {"short_ttc", "unprotected_left"},
            "motorway_weave": {"hard_braking", "lane_change", "cut_in"},
        }[map_name]
    )
    # The same road users, each as often; times differ by how tracks are thinned out.
    listed = sorted(
        (row["kind"], row["id"], row["other"] or "", row["begin"], row["end"])
        for row in found.to_dicts()
    )
    plain = sorted((kind, user, other or "", *times) for kind, user, other, *times in wanted)
    assert [scene[:3] for scene in listed] == [scene[:3] for scene in plain]
    for scene, other in zip(listed, plain, strict=True):
        assert scene[3:] == pytest.approx(other[3:], abs=0.1), scene


def test_a_turn_across_who_comes_is_found_and_one_behind_it_is_not(tmp_path: Path) -> None:
    workspace = odscen.Workspace.open(tmp_path / "workspace")
    workspace.add_map(ROOT / "maps" / "signal_crossing.xodr")
    graph = workspace.map("signal_crossing").graph()
    lanes = graph.lanes
    of = {str(key): row for row, key in enumerate(lanes.lanes.keys)}
    inside = [
        key
        for key, row in of.items()
        if lanes.lanes.junctions[row] is not None and lanes.lanes.types[row] == "driving"
    ]

    def path(key: str) -> np.ndarray[Any, Any]:
        first = lanes.lanes.first_node
        nodes = slice(int(first[of[key]]), int(first[of[key] + 1]))
        return np.column_stack([lanes.x[nodes], lanes.y[nodes], lanes.hdg[nodes]])

    def turn(key: str) -> float:
        hdg = path(key)[:, 2]
        return math.degrees(math.remainder(float(hdg[-1] - hdg[0]), math.tau))

    left = next(key for key in inside if turn(key) > 60.0)
    straight = next(
        key
        for key in inside
        if abs(turn(key)) < 10.0
        and abs(abs(math.remainder(path(key)[0, 2] - path(left)[0, 2], math.tau)) - math.pi) < 0.2
    )

    def drive(name: str, key: str, begin: float) -> pl.DataFrame:
        x, y, hdg = path(key).T
        way = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(x), np.diff(y)))])
        time = np.arange(0.0, way[-1] / 6.0, 0.1)
        return pl.DataFrame(
            {
                "id": name, "time": np.round(begin + time, 3),
                "x": np.interp(6.0 * time, way, x), "y": np.interp(6.0 * time, way, y),
                "hdg": np.interp(6.0 * time, way, np.unwrap(hdg)),
            }
        ).with_columns(kind=pl.lit("car"), length=pl.lit(4.5), width=pl.lit(1.8))  # fmt: skip

    parts = [drive("turns", left, 10.0), drive("comes", straight, 12.0)]
    # Two turn one behind the other, the first 8 s before one who comes: that is long enough.
    parts += [drive("first", left, 27.0), drive("ahead", left, 33.0)]
    parts += [drive("after", straight, 35.0)]
    placed, _ = fit_on_map(complete_tracks(pl.concat(parts), "test").rows, graph)
    scenes = find_scenes(placed, graph).filter(pl.col("kind") == "unprotected_left")
    assert [(row["id"], row["other"]) for row in scenes.to_dicts()] == [
        ("turns", "comes"),
        ("ahead", "after"),
    ]
    assert scenes["value"].to_list() == pytest.approx(
        (scenes["end"] - scenes["begin"]).to_list(), abs=1e-9
    )
    assert max(scenes["value"].to_list()) <= 5.0
