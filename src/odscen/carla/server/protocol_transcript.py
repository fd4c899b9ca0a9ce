"""Transcript of what a CARLA server and a client said to each other: one JSON object a line.

The first line says what the file is. Each other line is a frame: a call or its answer as they were
on the wire (msgpack-rpc), or a state of the world as it was streamed. What sensors see is not in a
transcript.
"""

from __future__ import annotations

import base64
import binascii
import json
from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING, Any

from odscen.base.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Iterable

FORM, VERSION = "odscen-carla-protocol", 1


class FrameKind(StrEnum):
    """What a frame is."""

    CALL = "call"
    ANSWER = "answer"
    STATE = "state"


@dataclass(frozen=True, slots=True)
class ProtocolFrame:
    """One frame.

    Attributes
    ----------
    at
        Seconds since the recording began.
    connection
        Counted from 1; 0 for states.
    name
        Of the function that is called or that has answered.
    number
        Of the call on its connection; the frame's own number for states.
    data
        As it was on the wire; of states without their length.
    """

    at: float
    connection: int
    kind: FrameKind
    name: str
    number: int
    data: bytes


def header_line() -> str:
    """First line of a transcript."""
    return json.dumps({"format": FORM, "version": VERSION}) + "\n"


def frame_line(frame: ProtocolFrame) -> str:
    """A frame as one line."""
    return (
        json.dumps(
            {
                "at": round(frame.at, 6),
                "connection": frame.connection,
                "kind": str(frame.kind),
                "name": frame.name,
                "number": frame.number,
                "data": base64.b64encode(frame.data).decode("ascii"),
            }
        )
        + "\n"
    )


def parse_transcript(lines: Iterable[str], *, file: str) -> list[ProtocolFrame]:
    """Frames of a transcript.

    A last line that was not written whole, because the recording was killed, is left out.

    Raises
    ------
    InputError
        If it is no transcript; names the line.
    """
    frames = []
    rows = enumerate(lines, start=1)
    _check_header(next(rows, (1, ""))[1], file=file)
    for number, line in rows:
        if not line.endswith("\n"):
            break
        try:
            frames.append(_parse_frame(json.loads(line)))
        except (ValueError, KeyError, TypeError, binascii.Error) as error:
            raise InputError(
                f"is no frame of a transcript: {error}", file=file, element=f"line {number}"
            ) from error
    return frames


def _check_header(line: str, *, file: str) -> None:
    try:
        head = json.loads(line)
    except ValueError:
        head = None
    if not isinstance(head, dict) or head.get("format") != FORM:
        raise InputError(
            f"is no transcript of CARLA's protocol: the first line has to name {FORM}",
            file=file,
            element="line 1",
        )
    if head.get("version") != VERSION:
        raise InputError(
            f"version {head.get('version')!r} is not known, {VERSION} is",
            file=file,
            element="line 1",
        )


def _parse_frame(row: dict[str, Any]) -> ProtocolFrame:
    return ProtocolFrame(
        float(row["at"]),
        int(row["connection"]),
        FrameKind(row["kind"]),
        str(row["name"]),
        int(row["number"]),
        base64.b64decode(row["data"], validate=True),
    )
