"""A country road over hills: bends of all kinds, elevation, superelevation, no-passing lines."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from scenariogeneration import xodr

from tools.make_maps.builder import Builder
from tools.make_maps.parts import End, LaneSpec, Pose, Profile, RoadRecord

LANE = LaneSpec("driving", 3.5, "solid", "none")
EDGE = LaneSpec("shoulder", 1.0)


def rural_hills(name: str) -> Builder:
    """Three roads end to end, 2.7 km."""
    builder = Builder(name)
    first = _road(builder, Pose(0.0, 0.0, 0.3), [("s", 250), ("c", 180, 220, 60), ("s", 200)], 20.0)
    second = _road(
        builder,
        first.end,
        [("s", 120), ("c", -140, 260, 70), ("p", 160, 25), ("c", 200, 180, 60), ("s", 150)],
        first_height(first),
    )
    builder.link(End(first, "end"), End(second, "start"))
    third = _road(
        builder, second.end, [("s", 100), ("c", -110, 150, 50), ("s", 300)], first_height(second)
    )
    builder.link(End(second, "end"), End(third, "start"))
    return builder


def first_height(record: RoadRecord) -> float:
    """Height at the end of a road, which the next one starts with."""
    return float(record.road.elevationprofile.eval_at_s(record.length))


def _road(
    builder: Builder, start: Pose, parts: Sequence[tuple[str | float, ...]], height: float
) -> RoadRecord:
    geometries: list[object] = []
    marks: list[tuple[float, str, str]] = []
    banks: list[tuple[float, float, float, float]] = []
    s = 0.0
    for kind, *values in parts:
        marks.append((s, "solid", "none") if kind == "c" else (s, "broken", "both"))
        if kind == "s":
            made: list[object] = [xodr.Line(values[0])]
        elif kind == "c":
            radius, arc, ease = (float(v) for v in values)
            k = 1.0 / radius
            made = [
                xodr.Spiral(0.0, k, length=ease),
                xodr.Arc(k, length=arc),
                xodr.Spiral(k, 0.0, length=ease),
            ]
            # Positive superelevation falls to the right: a left bend (k > 0) wants the other way.
            banks.append((s, ease, arc, -math.copysign(0.04, k)))
        else:
            made = [_shift(float(values[0]), float(values[1]))]
        geometries += made
        s += sum(geometry.get_end_data(0.0, 0.0, 0.0)[3] for geometry in made)  # type: ignore[attr-defined]
    profile = Profile((LANE, EDGE), (LANE, EDGE), tuple(marks))
    record = builder.road(start, geometries, profile, speed=80.0, kind="rural")
    _hills(record, height)
    for begin, ease, arc, bank in banks:
        _bank(record, begin, ease, arc, bank)
    _limit_sign(builder, record)
    return record


def _shift(length: float, aside: float) -> xodr.ParamPoly3:
    """Move ``aside`` metres to the left over ``length`` metres, heading the same at both ends."""
    p = np.linspace(0.0, 1.0, 2001)
    speed = np.hypot(length, aside * (6 * p - 6 * p**2))
    arc = float(np.trapezoid(speed, dx=1.0 / 2000))
    return xodr.ParamPoly3(0, length, 0, 0, 0, 0, 3 * aside, -2 * aside, "normalized", arc)


def _hills(record: RoadRecord, height: float) -> None:
    """Hermite pieces between knots about 150 m apart; flat at both ends, so that roads join."""
    count = max(2, round(record.length / 150.0))
    s = np.linspace(0.0, record.length, count + 1)
    z = height + 9.0 * np.sin(s / 170.0 + record.id) - 9.0 * math.sin(record.id)
    slope = 9.0 / 170.0 * np.cos(s / 170.0 + record.id)
    slope[[0, -1]] = 0.0
    for i in range(count):
        d = s[i + 1] - s[i]
        rise = (z[i + 1] - z[i]) / d
        record.road.add_elevation(
            float(s[i]),
            float(z[i]),
            float(slope[i]),
            float((3 * rise - 2 * slope[i] - slope[i + 1]) / d),
            float((slope[i] + slope[i + 1] - 2 * rise) / d**2),
        )


def _bank(record: RoadRecord, s: float, ease: float, arc: float, bank: float) -> None:
    """Turn the cross-section over the first spiral, back over the second."""
    rise = (3 * bank / ease**2, -2 * bank / ease**3)
    if not record.road.lateralprofile.superelevations and s > 0:
        record.road.add_superelevation(0.0, 0.0, 0.0, 0.0, 0.0)
    record.road.add_superelevation(s, 0.0, 0.0, *rise)
    record.road.add_superelevation(s + ease, bank, 0.0, 0.0, 0.0)
    record.road.add_superelevation(s + ease + arc, bank, 0.0, -rise[0], -rise[1])
    record.road.add_superelevation(s + 2 * ease + arc, 0.0, 0.0, 0.0, 0.0)


def _limit_sign(builder: Builder, record: RoadRecord) -> None:
    sign = xodr.Signal(
        20.0,
        -5.5,
        "DEU",
        "274",
        "-1",
        id=str(builder._id("signal")),
        name="Speed limit",
        value=80.0,
        unit="km/h",
        zOffset=2.0,
        orientation=xodr.Orientation.positive,
        height=0.6,
        width=0.6,
    )
    sign.add_validity(-1, -1)
    record.road.add_signal(sign)
