"""Poses and the only conversions between frames.

| pose | position | heading | reference point |
|---|---|---|---|
| `XodrPose` | x east, y north, z up | `hdg` rad, counter-clockwise from +x | body centre |
| `SumoPose` | xodr + netOffset | `angle_deg` clockwise from north | front bumper centre |
| `CarlaPose` | x east, y south, z up (left-handed) | `yaw_deg` clockwise from +x | body centre |

Pitch is positive nose up in all three; the distance bumper to centre is measured along the slope.
z of a :class:`SumoPose` is that of the front bumper. The functions are pure and take numpy arrays
as well as numbers (field by field), so that a whole trajectory converts in one call.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from odscen.base.arrays import FloatArray

    Real = float | FloatArray


class XodrPose(NamedTuple):
    """Body centre in the OpenDRIVE frame; metres and radians."""

    x: Real
    y: Real
    z: Real
    hdg: Real
    pitch: Real = 0.0


class SumoPose(NamedTuple):
    """Front bumper centre in the SUMO frame; metres, degrees; pitch in radians."""

    x: Real
    y: Real
    z: Real
    angle_deg: Real
    pitch: Real = 0.0


class CarlaPose(NamedTuple):
    """Body centre in the CARLA frame; metres and degrees."""

    x: Real
    y: Real
    z: Real
    yaw_deg: Real
    pitch_deg: Real = 0.0


def angle_deg_from_hdg(hdg: Real) -> Real:
    """SUMO angle in [0, 360) degrees of an OpenDRIVE heading in radians."""
    import numpy as np

    return np.mod(90.0 - np.degrees(hdg), 360.0)


def hdg_from_angle_deg(angle_deg: Real) -> Real:
    """OpenDRIVE heading in [-pi, pi) radians of a SUMO angle in degrees."""
    import numpy as np

    return np.mod(np.radians(90.0 - np.asarray(angle_deg)) + np.pi, 2.0 * np.pi) - np.pi


def xodr_to_sumo(
    pose: XodrPose, *, length: Real, net_offset: tuple[float, float] = (0.0, 0.0)
) -> SumoPose:
    """Body centre in OpenDRIVE to front bumper in SUMO; ``length`` of the body in metres."""
    import numpy as np

    half = np.asarray(length) / 2.0
    level = half * np.cos(pose.pitch)
    return SumoPose(
        x=pose.x + level * np.cos(pose.hdg) + net_offset[0],
        y=pose.y + level * np.sin(pose.hdg) + net_offset[1],
        z=pose.z + half * np.sin(pose.pitch),
        angle_deg=angle_deg_from_hdg(pose.hdg),
        pitch=pose.pitch,
    )


def sumo_to_xodr(
    pose: SumoPose, *, length: Real, net_offset: tuple[float, float] = (0.0, 0.0)
) -> XodrPose:
    """Front bumper in SUMO to body centre in OpenDRIVE; inverse of :func:`xodr_to_sumo`."""
    import numpy as np

    hdg = hdg_from_angle_deg(pose.angle_deg)
    half = np.asarray(length) / 2.0
    level = half * np.cos(pose.pitch)
    return XodrPose(
        x=pose.x - level * np.cos(hdg) - net_offset[0],
        y=pose.y - level * np.sin(hdg) - net_offset[1],
        z=pose.z - half * np.sin(pose.pitch),
        hdg=hdg,
        pitch=pose.pitch,
    )


def body_centre(
    x: float,
    y: float,
    angle_deg: float,
    *,
    length: float,
    net_offset: tuple[float, float] = (0.0, 0.0),
) -> tuple[float, float]:
    """X and y as of :func:`sumo_to_xodr` for one body on level ground, ten times as fast."""
    hdg = math.radians(90.0 - angle_deg)
    return (
        x - 0.5 * length * math.cos(hdg) - net_offset[0],
        y - 0.5 * length * math.sin(hdg) - net_offset[1],
    )


def xodr_to_carla(pose: XodrPose) -> CarlaPose:
    """OpenDRIVE to CARLA: y and the sense of rotation change sign."""
    import numpy as np

    return CarlaPose(
        x=pose.x,
        y=np.negative(pose.y),
        z=pose.z,
        yaw_deg=np.negative(np.degrees(pose.hdg)),
        pitch_deg=np.degrees(pose.pitch),
    )


def carla_to_xodr(pose: CarlaPose) -> XodrPose:
    """CARLA to OpenDRIVE; inverse of :func:`xodr_to_carla`."""
    import numpy as np

    return XodrPose(
        x=pose.x,
        y=np.negative(pose.y),
        z=pose.z,
        hdg=np.negative(np.radians(pose.yaw_deg)),
        pitch=np.radians(pose.pitch_deg),
    )
