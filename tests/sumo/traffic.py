"""Cars and persons let loose on a network of ours, and what they did, step by step."""

from __future__ import annotations

import os
import subprocess
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, NamedTuple
from xml.etree import ElementTree as ET

import sumo

from tests.sumo.conftest import BIN

if TYPE_CHECKING:
    from collections.abc import Sequence

    from tests.convert.maps import Converted

STEP = 0.1
"""Seconds."""

TYPES = (
    '<vType id="car" length="4.5" width="1.8" sigma="0" speedFactor="1" speedDev="0"/>'
    '<vType id="walker" vClass="pedestrian" speedFactor="1" speedDev="0" maxSpeed="1.4"/>'
)


@dataclass(frozen=True)
class Car:
    id: str
    edges: str
    depart: float = 0.0
    pos: float | None = None
    speed: str = "max"

    def xml(self) -> str:
        pos = "base" if self.pos is None else f"{self.pos:g}"
        return (
            f'<vehicle id="{self.id}" type="car" depart="{self.depart:g}" departPos="{pos}"'
            f' departSpeed="{self.speed}"><route edges="{self.edges}"/></vehicle>'
        )


@dataclass(frozen=True)
class Person:
    id: str
    edges: str
    depart: float = 0.0
    pos: float = 0.0
    arrival: float = -1.0

    def xml(self) -> str:
        return (
            f'<person id="{self.id}" type="walker" depart="{self.depart:g}"'
            f' departPos="{self.pos:g}"><walk edges="{self.edges}" arrivalPos="{self.arrival:g}"/>'
            "</person>"
        )


class Seen(NamedTuple):
    """One in one step; place in the OpenDRIVE frame."""

    time: float
    edge: str
    x: float
    y: float
    speed: float


@dataclass(frozen=True)
class Traffic:
    seen: dict[str, list[Seen]]
    arrived: frozenset[str]
    said: str

    def first_on(self, who: str, start: str) -> float:
        """When somebody came onto an edge whose name begins so."""
        return next(one.time for one in self.seen[who] if one.edge.startswith(start))

    def slowest(self, who: str, *edges: str) -> float:
        """Least speed of somebody, on these edges only if there are any."""
        return min(one.speed for one in self.seen[who] if not edges or one.edge in edges)


def drive(made: Converted, *who: Car | Person, until: float = 120.0, step: float = STEP) -> Traffic:
    """Run SUMO; teleports, collisions and emergency brakes are in ``said``."""
    with TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "net.net.xml").write_bytes(made.network.net_xml)
        order = sorted(who, key=lambda one: one.depart)
        routes = "\n".join(["<routes>", TYPES, *(one.xml() for one in order), "</routes>"])
        (folder / "routes.rou.xml").write_text(routes)
        done = subprocess.run(
            [
                BIN / "sumo", "-n", "net.net.xml", "-r", "routes.rou.xml",
                "--fcd-output", "fcd.xml", "--fcd-output.attributes", "id,x,y,speed,lane,edge",
                "--tripinfo-output", "trips.xml", "--step-length", str(step), "--no-step-log",
                "--end", str(until), "--collision.check-junctions", "--precision", "4",
                "--time-to-teleport", "-1", "--seed", "3", "--xml-validation", "never",
            ],
            cwd=folder,
            env={**os.environ, "SUMO_HOME": sumo.SUMO_HOME},
            capture_output=True,
            text=True,
            check=False,
        )  # fmt: skip
        assert done.returncode == 0, done.stderr
        arrived = frozenset(trip.get("id") for trip in ET.parse(folder / "trips.xml").getroot())
        return Traffic(_seen(folder / "fcd.xml", made.network.table.net_offset), arrived,
                       done.stderr)  # fmt: skip


def _seen(path: Path, offset: Sequence[float]) -> dict[str, list[Seen]]:
    found: dict[str, list[Seen]] = {}
    for step in ET.parse(path).getroot():
        for one in step:
            x, y = float(one.get("x")) - offset[0], float(one.get("y")) - offset[1]
            edge = one.get("edge") or one.get("lane").rsplit("_", 1)[0]
            seen = Seen(float(step.get("time")), edge, x, y, float(one.get("speed")))
            found.setdefault(one.get("id"), []).append(seen)
    return found
