"""What a behaviour model has answered, checked before anything is done with it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from odscen.base.errors import InputError
from odscen.learning.behaviour.behaviour_model import DrivingKind

if TYPE_CHECKING:
    from odscen.learning.behaviour.behaviour_model import DrivingAction
    from odscen.learning.fill import Array

_FASTEST = 150.0
"""m/s; a model that asks for more is mistaken."""
_NEEDS = {
    DrivingKind.SPEED: ("speed",), DrivingKind.SPEED_UNCHECKED: ("speed",),
    DrivingKind.LANE_POSITION: ("lane", "pos"), DrivingKind.POSE: ("x", "y", "hdg"),
}  # fmt: skip


class CheckedAction:
    """What a model has asked for, of ``count`` vehicles.

    Attributes
    ----------
    rows
        Of those that it controls.
    kind, speed, change
        A value for each vehicle; speed and change ``None`` if it does not use them.
    real, whole
        The other fields that it uses, by name; values of those that it does not control mean
        nothing.

    Raises
    ------
    InputError
        If shapes, types or values are not possible, or a field is missing.
    """

    def __init__(self, action: DrivingAction, controlled: Any, count: int) -> None:
        mask = np.asarray(controlled)
        if mask.shape != (count,) or mask.dtype != np.bool_:
            raise InputError(f"is_controlled is {mask.dtype} {mask.shape}, not bool ({count},)")
        self.rows = np.flatnonzero(mask)
        kinds = np.broadcast_to(np.asarray(action.kind), (count,))
        some = kinds[mask] if np.ndim(action.kind) else kinds[self.rows[:1]]
        used = np.unique(some).tolist()
        if unknown := [kind for kind in used if kind not in {*DrivingKind}]:
            raise InputError(f"there is no kind of action {unknown[0]!r}")
        self.kind = kinds
        self.real = {
            name: self._numbers(action, name, count)
            for name in ("speed", "pos", "x", "y", "hdg")
            if getattr(action, name) is not None
        }
        self.whole = {
            name: self._numbers(action, name, count).astype(np.int64)
            for name in ("lane", "change")
            if getattr(action, name) is not None
        }
        for kind in used:
            for name in _NEEDS[DrivingKind(kind)]:
                if name not in self.real and name not in self.whole:
                    raise InputError(f"an action of kind {DrivingKind(kind).name} needs {name}")
        speed = self.real.get("speed")
        if speed is not None and len(self.rows):
            low, high = speed[self.rows].min(), speed[self.rows].max()
            if low < 0.0 or high > _FASTEST:
                bad = low if low < 0.0 else high
                raise InputError(f"a speed of {bad:g} m/s is not between 0 and {_FASTEST:g}")
        self.speed = speed
        self.change = self.whole.get("change")

    def _numbers(self, action: DrivingAction, name: str, count: int) -> Array:
        try:
            values = np.asarray(getattr(action, name), dtype=np.float64)
        except (TypeError, ValueError) as error:
            raise InputError(f"{name} is no array of numbers") from error
        if values.shape != (count,):
            raise InputError(f"{name} has shape {values.shape}, not ({count},)")
        bad = ~np.isfinite(values[self.rows])
        if bad.any():
            row = int(self.rows[np.flatnonzero(bad)[0]])
            raise InputError(f"{name} of row {row} is {values[row]:g}")
        return np.where(np.isfinite(values), values, 0.0)
