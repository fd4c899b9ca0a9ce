"""Routes for the picture that lies under a map."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Annotated

from fastapi import APIRouter, File, Form, UploadFile
from starlette.responses import Response

from odscen.base.checksums import digest
from odscen.base.errors import InputError, NotFoundError
from odscen.base.shown import printable
from odscen.maps.background import MOST_BYTES, PicturePoint
from odscen.web.services import Shared
from odscen.web.wire.map_messages import BackgroundInfo
from odscen.web.wire.media_types import ANY_FILE

if TYPE_CHECKING:
    from odscen.maps.background import Background

router = APIRouter(prefix="/api/maps/{name}/background")

_MOST_WORLD = 4096
"""Bytes of a world file: six numbers."""


@router.get("")
def show_background(name: str, shared: Shared) -> BackgroundInfo | None:
    """The picture under a map, if it has one."""
    found = shared.workspace.background(name)
    return None if found is None else _describe_background(found)


@router.get("/picture", response_class=Response, responses=ANY_FILE)
def show_picture(name: str, shared: Shared) -> Response:
    """The picture itself, PNG or JPEG."""
    found = shared.workspace.background(name)
    if found is None:
        raise NotFoundError("picture under map", name, [])
    headers = {
        "Content-Security-Policy": "default-src 'none'; sandbox",
        "Cache-Control": "no-cache",
    }
    return Response(found.read(), media_type=found.media_type, headers=headers)


@router.post("")
def set_background(
    name: str,
    shared: Shared,
    file: Annotated[UploadFile, File(description="PNG, JPEG or TIFF.")],
    world: Annotated[UploadFile | None, File(description="World file.")] = None,
    crs: Annotated[str | None, Form(description="Of the world file; else metres.")] = None,
    points: Annotated[
        str | None, Form(description="JSON: rows of column, row, x and y, two or more.")
    ] = None,
) -> BackgroundInfo:
    """Lay a picture under a map, in place of the one that it has."""
    content = file.file.read(MOST_BYTES + 1)
    text = None
    if world is not None:
        try:
            text = world.file.read(_MOST_WORLD).decode("ascii")
        except UnicodeDecodeError:
            raise InputError("a world file has six numbers; this one is no text") from None
    found = shared.workspace.set_background(
        name,
        content,
        source=printable(file.filename or "picture")[:120],
        world=text,
        crs=crs or None,
        points=_parse_points(points),
    )
    return _describe_background(found)


@router.delete("", status_code=204)
def remove_background(name: str, shared: Shared) -> None:
    """Take the picture under a map away."""
    shared.workspace.remove_background(name)


def _parse_points(text: str | None) -> list[PicturePoint]:
    try:
        rows = json.loads(text or "[]")
        return [PicturePoint(*map(float, row)) for row in rows]
    except (ValueError, TypeError, ArithmeticError, RecursionError) as error:
        raise InputError(
            f"points of a picture are rows of column, row, x and y, as JSON: {error}"
        ) from None


def _describe_background(found: Background) -> BackgroundInfo:
    stamp = found.path.stat()
    return BackgroundInfo(
        source=found.source,
        width=found.width,
        height=found.height,
        affine=list(found.affine),
        version=digest(f"{stamp.st_mtime_ns} {stamp.st_size}".encode())[:12],
    )
