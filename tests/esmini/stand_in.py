"""In the place of esmini: road users are where the lines of the file have them at each time.

``MISBEHAVE`` says what goes wrong: ``ends`` after ten steps with a code, ``refuses`` before any,
``contact`` of the first two for three steps, ``aside``: all are 0.5 m to the left, ``waits``: the
first step never comes, ``back``: the first is away in the steps 12 to 19.
"""

import argparse
import math
import os
import sys
import time
from pathlib import Path
from typing import Any

from lxml import etree

COLUMNS = (
    "Entity_Name [-]", "Entity_ID [-]", "Current_Speed [m/s]", "bb_x [m]", "bb_y [m]",
    "World_Position_X [m]", "World_Position_Y [m]", "World_Position_Z [m]",
    "World_Heading_Angle [rad]", "collision_ids",
)  # fmt: skip

if sys.argv[1:] == ["--version"]:
    sys.stdout.write("esmini GIT REV: v0.0-stand-in\n")
    sys.exit()
parser = argparse.ArgumentParser()
for name in ("--osc", "--csv_logger", "--pline_interpolation"):
    parser.add_argument(name)
for name in ("--fixed_timestep", "--traj_filter", "--seed"):
    parser.add_argument(name, type=float)
for name in ("--headless", "--collision", "--disable_log"):
    parser.add_argument(name, action="store_true", required=True)
given = parser.parse_args()
wrong = os.environ.get("MISBEHAVE", "")
root: Any = etree.parse(given.osc).getroot()
assert Path(root.find(".//LogicFile").get("filepath")).is_file()
lines = {}
for group in root.iter("ManeuverGroup"):
    (name,) = {entity.get("entityRef") for entity in group.iter("EntityRef")} or {None}
    points = [
        [float(vertex.get("time")), *(float(pose.get(part)) for part in ("x", "y", "z", "h"))]
        for vertex in group.iter("Vertex")
        for pose in vertex.iter("WorldPosition")
    ]
    if points:
        lines[name] = points
names = [entity.get("name") for entity in root.iter("ScenarioObject")]
ahead = {
    entity.get("name"): float(entity.find(".//BoundingBox/Center").get("x"))
    for entity in root.iter("ScenarioObject")
}
(until,) = {
    float(condition.get("value"))
    for condition in root.find(".//StopTrigger").iter("SimulationTimeCondition")
}
if wrong == "refuses":
    sys.stdout.write("[0.000] [error] Exception: the stand-in takes no such file\n")
    sys.exit()
with Path(given.csv_logger).open("w", encoding="utf-8") as table:
    table.write("esmini GIT REV: v0.0-stand-in\nNumber of Vehicles: 3\nIndex [-], TimeStamp [s], ")
    table.write("".join(f"#1 {column}, " for column in COLUMNS) + "\n")
    if wrong == "waits":
        table.flush()
        time.sleep(60)
    step = 0
    while (now := step * given.fixed_timestep) <= until + 1e-9:
        if wrong == "ends" and step == 10:
            table.close()
            sys.stdout.write(
                "[5.000] [error] the stand-in was told to end\n[5.000] [info] Closing\n"
            )
            sys.exit(7)
        table.write(f"{step}, {now:f}, ")
        there = [
            name for name in names
            if name in lines and lines[name][0][0] - 1e-6 <= now <= lines[name][-1][0] + 1e-6
        ]  # fmt: skip
        if wrong == "back" and 12 <= step < 20:
            there = [name for name in there if name != names[0]]
        touch = wrong == "contact" and 12 <= step < 15
        for name in there:
            before = max(point for point in lines[name] if point[0] <= now + 1e-6)
            _, x, y, z, h = before
            aside = 0.5 if wrong == "aside" else 0.0
            touched = " ".join(
                str(names.index(other)) for other in there[:2] if touch and other != name
            )
            table.write(
                f"{name}, {names.index(name)}, 1.500000, {ahead[name]:f}, 0.000000, "
                f"{x - aside * math.sin(h):f}, {y + aside * math.cos(h):f}, {z:f}, {h:f}, "
                f"{touched if name in there[:2] else ''}, "
            )
        if there:
            table.write("\n")
        step += 1
