"""A one-lane roundabout: at each arm a small junction, ring roads between them."""

from __future__ import annotations

import math

from scenariogeneration import xodr

from tools.make_maps.builder import Builder
from tools.make_maps.parts import WALK, End, LaneSpec, Pose, Profile

RADIUS = 14.0
"""Metres, of the inner border of the lane."""
HALF_ANGLE = math.radians(32.0)
"""Half of the ring's angle that the junction of an arm takes."""
RING = Profile((LaneSpec("driving", 4.0, "solid"), WALK))


def roundabout_arms(builder: Builder, centre: Pose, arms: dict[int, End]) -> None:
    """Join ``arms`` (by direction in quarter turns) around ``centre``; traffic goes left around."""
    directions = sorted(arms)
    rings: dict[int, tuple[End, End]] = {}
    for place, direction in enumerate(directions):
        following = directions[(place + 1) % len(directions)]
        begin = direction * math.pi / 2 + HALF_ANGLE
        angle = ((following - direction) % 4 or 4) * math.pi / 2 - 2 * HALF_ANGLE
        start = Pose(
            centre.x + RADIUS * math.cos(begin),
            centre.y + RADIUS * math.sin(begin),
            begin + math.pi / 2,
        )
        record = builder.road(
            start, [xodr.Arc(1 / RADIUS, length=RADIUS * angle)], RING, speed=30.0
        )
        rings[direction] = (End(record, "start"), End(record, "end"))
    for place, direction in enumerate(directions):
        before = directions[place - 1]
        ends = [arms[direction], rings[direction][0], rings[before][1]]
        junction = builder.new_junction(ends)
        arm, out, into = ends
        builder.connect(junction, into, arm, [(0, 0), (1, 1)], speed=30.0)
        builder.connect(junction, into, out, [(0, 0)], speed=30.0)
        builder.connect(junction, arm, out, [(0, 0), (1, 1)], speed=30.0)
        builder.crosswalk(arm)
        builder.stop_line(arm, back=5.0)
        builder.signal(arm, "205", name="Yield")
        builder.priorities[junction.id] = [(into.record.id, arm.record.id)]
