"""Single junctions: lights, signs, and one for left-hand traffic."""

from __future__ import annotations

import math

from scenariogeneration import xodr

from tools.make_maps.builder import Builder
from tools.make_maps.crossing import crossing
from tools.make_maps.geometry import Pose
from tools.make_maps.parts import BROKEN, SOLID, End, LaneSpec, Profile, street

EAST, NORTH, WEST, SOUTH = (k * math.pi / 2 for k in range(4))
COMPASS = {"east": EAST, "north": NORTH, "west": WEST, "south": SOUTH}
ORIGIN = Pose(0.0, 0.0, 0.0)

POCKET = 3.25
"""Width of a left-turn lane."""


def signal_crossing(name: str) -> Builder:
    """Four arms with lights, left-turn lanes, bicycle lanes, sidewalks and crosswalks."""
    builder = Builder(name)
    arms = [
        _pocket_arm(builder, heading, reach=17.0, length=130.0, label=label)
        for label, heading in COMPASS.items()
    ]
    crossing(builder, arms, control="lights", name="Signal crossing")
    return builder


def t_junction_signs(name: str) -> Builder:
    """Main road west-east; a side road from the south stops, one from the north yields."""
    builder = Builder(name)
    second = Pose(110.0, 0.0, 0.0)
    # The road between the two junctions belongs to both.
    east = arm(builder, EAST, reach=14.0, length=second.x - 28.0, label="Main Road")
    west = arm(builder, WEST, reach=14.0, length=120.0, label="Main Road")
    south = arm(builder, SOUTH, reach=14.0, length=100.0, label="Stop Lane", speed=30.0)
    far = arm(builder, EAST, reach=14.0, length=120.0, centre=second, label="Main Road")
    north = arm(
        builder, NORTH, reach=14.0, length=100.0, centre=second, label="Yield Lane", speed=30.0
    )
    crossing(builder, [east, south, west], control="stop", major=(0, 2), name="Stop")
    near = End(east.record, "start")
    crossing(builder, [far, north, near], control="yield", major=(0, 2), name="Yield")
    return builder


def left_hand_crossing(name: str) -> Builder:
    """Made for right-hand traffic and mirrored when written."""
    builder = Builder(name)
    arms = [
        arm(builder, heading, reach=15.0, length=120.0, label=f"{label.title()} Road")
        for label, heading in COMPASS.items()
    ]
    crossing(builder, arms, control="lights", name="Left-hand crossing")
    return builder


def arm(
    builder: Builder,
    heading: float,
    *,
    reach: float,
    length: float,
    centre: Pose = ORIGIN,
    speed: float = 50.0,
    label: str = "",
) -> End:
    """Straight street that ends ``reach`` metres from ``centre``, coming from ``heading``."""
    far = Pose(centre.x, centre.y, heading).ahead(reach + length)
    record = builder.road(far.back(), [xodr.Line(length)], street(), speed=speed, name=label)
    return End(record, "end")


def _pocket_arm(
    builder: Builder, heading: float, *, reach: float, length: float, label: str
) -> End:
    """Make an arm with bicycle lanes, and a left-turn lane for those who arrive.

    The reference line, between the two directions, is half a lane to the left, so that lanes of
    opposite arms face each other. (CARLA adds a lane offset, which would do the same, to the t of
    crosswalks.)
    """
    plain = street(bikes=True)
    pocket = LaneSpec("driving", POCKET, BROKEN, key="pocket")
    far = Pose(0.0, 0.0, heading).ahead(reach + length).left(-POCKET / 2)
    record = builder.road(
        far.back(),
        [xodr.Line(length)],
        Profile((pocket, *plain.right), plain.left, SOLID),
        name=f"{label.title()} Street",
    )
    return End(record, "end")
