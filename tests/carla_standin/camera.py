"""Pictures: the world from straight above, drawn flat, enough to see that frames come."""

from __future__ import annotations

from collections.abc import Iterable
from math import cos, radians, sin, tan

import numpy as np

from tests.carla_standin import wire
from tests.carla_standin.actors import Actor, Kind

GROUND = (70, 70, 70, 255)
"""B, G, R, A."""
BODY = {Kind.VEHICLE: (200, 120, 40, 255), Kind.WALKER: (40, 200, 240, 255)}
_HEIGHT = 40.0
"""Metres above a level camera from which its picture is taken, with its own field of view."""
_DOWN = -80.0
"""Degrees of pitch below which a camera looks down, and its picture is taken from where it is."""


def take(actor: Actor, bodies: Iterable[Actor], *, frame: int, elapsed: float) -> bytes:
    """Image message of a camera: the camera is in the middle, what is before it is further up."""
    width = int(actor.attribute("image_size_x"))
    height = int(actor.attribute("image_size_y"))
    fov = float(actor.attribute("fov"))
    pixels = np.empty((height, width, 4), dtype=np.uint8)
    pixels[:] = GROUND
    for body in bodies:
        height_above = actor.at[2] - body.at[2] if actor.at[3] < _DOWN else _HEIGHT
        if height_above > 0.0:
            _draw(pixels, actor, body, width / (2.0 * height_above * tan(radians(fov) / 2.0)))
    return wire.image_message(
        frame=frame,
        elapsed=elapsed,
        at=actor.at,
        width=width,
        height=height,
        fov=fov,
        bgra=pixels.tobytes(),
    )


def _draw(pixels: np.ndarray, camera: Actor, body: Actor, per_metre: float) -> None:
    """Fill the rectangle of a body; ``ahead`` and ``right`` are metres from the camera."""
    height, width, _ = pixels.shape
    box = body.footprint()
    yaw = radians(camera.at[4])
    dx, dy = box.x - camera.at[0], box.y - camera.at[1]
    ahead, right = dx * cos(yaw) + dy * sin(yaw), dy * cos(yaw) - dx * sin(yaw)
    column, row = width / 2 + right * per_metre, height / 2 - ahead * per_metre
    reach = box.radius * per_metre + 1.0
    top, bottom = max(int(row - reach), 0), min(int(row + reach) + 1, height)
    first, last = max(int(column - reach), 0), min(int(column + reach) + 1, width)
    if top >= bottom or first >= last:
        return
    rows, columns = np.mgrid[top:bottom, first:last]
    up = (row - rows - 0.5) / per_metre
    aside = (columns + 0.5 - column) / per_metre
    turn = radians(body.at[4]) - yaw
    along = np.abs(up * cos(turn) + aside * sin(turn))
    across = np.abs(aside * cos(turn) - up * sin(turn))
    inside = (along <= box.half_length) & (across <= box.half_width)
    pixels[top:bottom, first:last][inside] = BODY[body.kind]
