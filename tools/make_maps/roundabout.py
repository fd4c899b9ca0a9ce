"""A one-lane roundabout: at each arm a small junction, ring roads between them."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from scenariogeneration import xodr

from tools.make_maps import furniture
from tools.make_maps.builder import Builder
from tools.make_maps.crossings import COMPASS, ORIGIN, arm
from tools.make_maps.geometry import Pose
from tools.make_maps.parts import SOLID, End, LaneSpec, Profile

if TYPE_CHECKING:
    from collections.abc import Mapping

RADIUS = 14.0
"""Metres, of the inner border of the lane."""
REACH = 30.0
"""Metres from the middle to where the arms end."""
HALF_ANGLE = math.radians(33.0)
"""Half of the ring's angle that the junction of an arm takes."""
RING = Profile(
    (LaneSpec("driving", 3.75, SOLID, key="car 0"), LaneSpec("sidewalk", 2.5, key="walk")),
    (),
    SOLID,
)
SPEED = 30.0


def roundabout(name: str) -> Builder:
    """Four arms with crosswalks, yield signs, one lane around."""
    builder = Builder(name)
    arms = {
        quarter: arm(builder, heading, reach=REACH, length=110.0, label=f"{label.title()} Road")
        for quarter, (label, heading) in enumerate(COMPASS.items())
    }
    roundabout_arms(builder, ORIGIN, arms)
    return builder


def roundabout_arms(builder: Builder, centre: Pose, arms: Mapping[int, End]) -> None:
    """Join ``arms`` (by direction in quarter turns) around ``centre``; traffic goes left around."""
    directions = sorted(arms)
    rings: dict[int, tuple[End, End]] = {}
    for place, direction in enumerate(directions):
        following = directions[(place + 1) % len(directions)]
        begin = direction * math.pi / 2 + HALF_ANGLE
        angle = ((following - direction) % 4 or 4) * math.pi / 2 - 2 * HALF_ANGLE
        start = Pose(centre.x, centre.y, begin).ahead(RADIUS).turned(math.pi / 2)
        arc = xodr.Arc(1 / RADIUS, length=RADIUS * angle)
        record = builder.road(start, [arc], RING, speed=SPEED, name="Roundabout")
        rings[direction] = (End(record, "start"), End(record, "end"))
    for place, direction in enumerate(directions):
        street, out = arms[direction], rings[direction][0]
        into = rings[directions[place - 1]][1]
        junction = builder.new_junction([street, out, into], "Roundabout")
        builder.connect(junction, into, street, [(0, 0), (1, 1)], speed=SPEED)
        builder.connect(junction, into, out, [(0, 0)], speed=SPEED)
        builder.connect(junction, street, out, [(0, 0), (1, 1)], speed=SPEED)
        furniture.crosswalk(builder, street)
        furniture.stop_line(builder, street, back=furniture.STOP_LINE)
        furniture.sign(builder, street, "205", "Yield")
        furniture.solid_lines(street)
        builder.priorities[junction.id] = [(into.record.id, street.record.id)]
