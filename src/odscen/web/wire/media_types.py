"""Answers that are no JSON, as the schema shows them."""

from __future__ import annotations

from typing import Any

Responses = dict[int | str, dict[str, Any]]
"""What FastAPI calls ``responses``."""


def answers(*media_types: str, text: bool = False) -> Responses:
    """An answer of one of some media types: bytes, or text.

    To be given to a route beside ``response_class=Response``; with a class that has a media type of
    its own FastAPI would say that errors have it too.
    """
    schema = {"type": "string"} if text else {"type": "string", "format": "binary"}
    return {200: {"content": {media_type: {"schema": schema} for media_type in media_types}}}


HTML = answers("text/html", text=True)
SVG = answers("image/svg+xml", text=True)
PICTURES = answers("multipart/x-mixed-replace")
ANY_FILE = answers("*/*")
