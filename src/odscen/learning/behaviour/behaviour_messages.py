"""Messages between a run and a program that drives: a length and so many bytes, either way.

Each message is eight bytes, its length as a little-endian unsigned number, and then so many:

1. to the program, once: the scene, as ``.npz``, with ``seed``;
2. from the program: an empty message, when it is ready;
3. to the program, before each step: the observation, as ``.npy`` with a row for each vehicle;
4. from the program: what to do, as ``.npy`` with as many rows.

Rows have the fields of :class:`~odscen.learning.behaviour.behaviour_model.RoadObservation`, with
``time`` in each; rows back have ``controlled`` and those fields of
:class:`~odscen.learning.behaviour.behaviour_model.DrivingAction` that are used.
"""

from __future__ import annotations

import io
import struct
import sys
from dataclasses import fields
from typing import IO, TYPE_CHECKING, Any, Final

import numpy as np

from odscen.base.errors import InputError
from odscen.learning.behaviour.behaviour_model import (
    AHEAD,
    BehaviourScene,
    DrivingAction,
    RoadObservation,
)

if TYPE_CHECKING:
    from odscen.base.arrays import BoolArray
    from odscen.learning.behaviour.behaviour_model import BehaviourModel
    from odscen.learning.fill import Array

HEAD: Final = struct.Struct("<Q")
MOST_BYTES: Final = 1 << 28
"""Of a message."""
_WHOLE = ("index", "lane", "leader", "light")
_YES_NO = ("can_left", "can_right")


def _column_form(name: str) -> tuple[Any, ...]:
    if name == "ahead":
        return name, "<i4", (AHEAD,)
    return name, "<i4" if name in _WHOLE else "?" if name in _YES_NO else "<f8"


_ROWS: Final = np.dtype([_column_form(field.name) for field in fields(RoadObservation)])
_ACTIONS: Final = tuple(field.name for field in fields(DrivingAction))


def scene_bytes(scene: BehaviourScene, seed: int) -> bytes:
    """The scene as ``.npz``."""
    arrays: dict[str, Any] = {field.name: getattr(scene, field.name) for field in fields(scene)}
    stream = io.BytesIO()
    np.savez(stream, seed=np.int64(seed), **arrays)
    return stream.getvalue()


def scene_from_bytes(data: bytes) -> tuple[BehaviourScene, int]:
    """Inverse of :func:`scene_bytes`."""
    with np.load(io.BytesIO(data), allow_pickle=False) as arrays:
        found: dict[str, Any] = {field.name: arrays[field.name] for field in fields(BehaviourScene)}
        for name in ("step_length", "time"):
            found[name] = float(found[name])
        return BehaviourScene(**found), int(arrays["seed"])


def observation_bytes(seen: RoadObservation) -> bytes:
    """An observation as rows."""
    rows = np.empty(len(seen), dtype=_ROWS)
    for name in _ROWS.names or ():
        rows[name] = getattr(seen, name)
    return _pack_npy(rows)


def observation_from_bytes(data: bytes) -> RoadObservation:
    """Inverse of :func:`observation_bytes`; at least one row."""
    rows = np.load(io.BytesIO(data), allow_pickle=False)
    found: dict[str, Any] = {name: rows[name] for name in _ROWS.names or ()}
    found["time"] = float(rows["time"][0])
    return RoadObservation(**found)


def action_bytes(action: DrivingAction, controlled: BoolArray) -> bytes:
    """What to do as rows."""
    used = [name for name in _ACTIONS if getattr(action, name) is not None]
    kinds = {"kind": "u1", "lane": "<i4", "change": "<i4"}
    form = [("controlled", "?"), *((name, kinds.get(name, "<f8")) for name in used)]
    rows = np.zeros(len(controlled), dtype=form)
    rows["controlled"] = controlled
    for name in used:
        rows[name] = getattr(action, name)
    return _pack_npy(rows)


def action_from_bytes(data: bytes, count: int) -> tuple[DrivingAction, BoolArray]:
    """Inverse of :func:`action_bytes`.

    Raises
    ------
    InputError
        If they are no such rows.
    """
    try:
        rows = np.load(io.BytesIO(data), allow_pickle=False)
    except (ValueError, EOFError, OSError) as error:
        raise InputError(f"its answer is no .npy array: {error}") from error
    names = getattr(rows, "dtype", np.dtype("f8")).names or ()
    unknown = sorted(set(names) - {"controlled", *_ACTIONS})
    if "controlled" not in names or unknown:
        what = f"field {unknown[0]!r}" if unknown else "no field 'controlled'"
        raise InputError(f"its answer has {what}; it may have controlled, {', '.join(_ACTIONS)}")
    if rows.shape != (count,):
        raise InputError(f"its answer has shape {rows.shape}, not ({count},)")
    given: dict[str, Array] = {name: rows[name] for name in names if name != "controlled"}
    return DrivingAction(**given), rows["controlled"].astype(bool)


def framed(data: bytes) -> bytes:
    """A message with its length."""
    return HEAD.pack(len(data)) + data


def serve(
    model: BehaviourModel, given: IO[bytes] | None = None, back: IO[bytes] | None = None
) -> None:
    """Drive as another process: answer a run until it has ended.

    Parameters
    ----------
    model
        Drives.
    given, back
        Where messages come from and go to; stdin and stdout if not given.
    """
    stdin, stdout = given or sys.stdin.buffer, back or sys.stdout.buffer
    first = _read_message(stdin)
    if first is None:
        return
    scene, seed = scene_from_bytes(first)
    state = model.init(np.random.default_rng(seed), scene)
    answer = b""
    while True:
        stdout.write(framed(answer))
        stdout.flush()
        data = _read_message(stdin)
        if data is None:
            return
        answer = action_bytes(*model.act(observation_from_bytes(data), state))


def _read_message(stream: IO[bytes]) -> bytes | None:
    head = stream.read(HEAD.size)
    return stream.read(HEAD.unpack(head)[0]) if len(head) == HEAD.size else None


def _pack_npy(rows: Array) -> bytes:
    stream = io.BytesIO()
    np.lib.format.write_array(stream, rows, allow_pickle=False)
    return stream.getvalue()
