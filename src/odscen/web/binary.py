"""Answers that are no JSON, each with the media type that the schema shows."""

from __future__ import annotations

from starlette.responses import FileResponse, Response, StreamingResponse


class Svg(Response):
    """A drawing."""

    media_type = "image/svg+xml"


class Pictures(StreamingResponse):
    """Pictures that replace each other."""

    media_type = "multipart/x-mixed-replace"


class AnyFile(FileResponse):
    """A file of a kind that its name tells."""

    media_type = "*/*"
