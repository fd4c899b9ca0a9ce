"""Files of others that are n times as large: recordings, maps, scenes, projects, histories.

Each function writes one below a folder; how long odscen takes for it is measured by
:mod:`bench.sizes`. Files are of one kind of part, as many of it as asked for.
"""

from __future__ import annotations

import json
import xml.etree.ElementTree as ET
from collections.abc import Callable
from pathlib import Path

from tests.formats.tracks.test_tracks_on_maps import crossing_traffic
from tests.maps.importers.lanelet_files import LaneletFile
from tests.maps.importers.test_openstreetmap import place_of

STEP = 0.1
HEAD = "time,id,x,y,hdg,speed,length,width,class\n"
COLUMNS = "time=time,id=id,x=x,y=y,hdg=hdg,speed=speed,length=length,width=width,kind=class"


def _write_tracks(folder: Path, rows: list[str]) -> Path:
    file = folder / "tracks.csv"
    file.write_text(HEAD + "".join(rows), encoding="utf-8")
    return file


def users_at_once(folder: Path, number: int) -> Path:
    """Cars eight metres apart on a line that the crossing's long road is a part of, ten frames."""
    return _write_tracks(
        folder,
        [
            f"{frame * STEP:.1f},c{n},{8.0 * (n - number // 2) + 0.8 * frame:.2f},-1.625,"
            "0,8,4.5,1.8,car\n"
            for n in range(number)
            for frame in range(10)
        ],
    )


def users_in_turn(folder: Path, number: int) -> Path:
    """Cars that come one after the other, five seconds of each."""
    return _write_tracks(
        folder,
        [
            f"{3.0 * n + frame * STEP:.1f},c{n},{-100 + 0.8 * frame:.2f},-1.625,0,8,4.5,1.8,car\n"
            for n in range(number)
            for frame in range(50)
        ],
    )


def frames_of_a_few(folder: Path, number: int) -> Path:
    """Two cars that wait, one behind the other."""
    return _write_tracks(
        folder,
        [
            f"{frame * STEP:.1f},c{n},{-100 + 8 * n},-1.625,0,0,4.5,1.8,car\n"
            for frame in range(number)
            for n in range(2)
        ],
    )


def crossings_of_walkers(folder: Path, number: int) -> Path:
    """Scenes: each walker crosses before a car."""
    rows = crossing_traffic().filter(id="walks")
    times, ys = rows["time"].to_list(), rows["y"].to_list()
    made = []
    for n in range(number):
        for time, y in zip(times, ys, strict=True):
            at = time - 15.0 + 10.0 * n
            made.append(f"{at:.2f},w{n},-50,{y:.2f},-1.57,1.5,0.4,0.4,pedestrian\n")
            made.append(f"{at:.2f},c{n},{-90 + 8.0 * (time - 15.0):.2f},-1.625,0,8,4.5,1.8,car\n")
    return _write_tracks(folder, made)


def streets(folder: Path, number: int) -> Path:
    """Parallel streets of OpenStreetMap, each with a crossing of one that joins them all."""
    nodes, ways = {}, {}
    for n in range(number):
        for m, x in enumerate((-150.0, 0.0, 150.0)):
            nodes[3 * n + m + 1] = (x, 100.0 * n)
        ways[n + 1] = ([3 * n + 1, 3 * n + 2, 3 * n + 3], {"highway": "residential"})
        if n:
            ways[number + n + 1] = ([3 * n - 1, 3 * n + 2], {"highway": "residential"})
    file = folder / "place.osm"
    file.write_bytes(place_of(nodes, ways))
    return file


def lanelets(folder: Path, number: int) -> Path:
    """One lane of lanelets of 20 m each."""
    made = LaneletFile()
    for n in range(number):
        sides = [[(20.0 * n, y), (20.0 * n + 20.0, y)] for y in (3.5, 0.0)]
        made.lanelet(made.way(sides[0]), made.way(sides[1]))
    file = folder / "lanes.osm"
    file.write_bytes(ET.tostring(made.root))
    return file


def commits(folder: Path, number: int) -> Path:
    """A history of a suite of two cases."""
    lines = [
        {
            "format": "odscen-history",
            "version": 1,
            "suite": "city",
            "commit": f"{commit:040x}",
            "date": f"20{20 + commit // 12 // 28 % 70:02}-{commit % 12 + 1:02}"
            f"-{commit // 12 % 28 + 1:02}T12:00:00+01:00",
            "cases": {
                name: {
                    "status": "passed",
                    "seeds": [1, 2],
                    "figures": {"mean_delay": 10.0 + commit % 7 + commit // 50, "arrived": 0.98},
                }
                for name in ("rush", "night")
            },
        }
        for commit in range(number)
    ]
    file = folder / "history.jsonl"
    file.write_text("".join(json.dumps(line) + "\n" for line in lines), encoding="utf-8")
    return file


FILES: dict[str, tuple[str, Callable[[Path, int], Path], int]] = {
    "road users of a recording at once": ("recording", users_at_once, 250),
    "road users of a recording in turn": ("recording", users_in_turn, 250),
    "frames of a recording": ("recording", frames_of_a_few, 5000),
    "walkers who cross in a recording": ("recording", crossings_of_walkers, 50),
    "streets of OpenStreetMap": ("map", streets, 25),
    "lanelets": ("map", lanelets, 25),
    "commits of a history": ("history", commits, 250),
}
"""By what is counted: the command that reads it, what writes it, and the least number of it."""
