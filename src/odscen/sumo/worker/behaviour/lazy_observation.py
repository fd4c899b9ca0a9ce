"""An observation whose fields are read when a model first looks at them.

A model that looks at speeds alone does not pay for places. What is read is what stands in the
simulation before the step: :meth:`LazyObservation.read_all` is for an observation that outlives it.
"""

from __future__ import annotations

from dataclasses import fields
from typing import TYPE_CHECKING, Any

from odscen.learning.behaviour.behaviour_model import RoadObservation

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from odscen.base.arrays import Int32Array

_FIELDS = tuple(field.name for field in fields(RoadObservation))


class LazyObservation(RoadObservation):
    """The observation.

    Parameters
    ----------
    read
        Returns values of some fields, that of the name given among them.
    """

    __slots__ = ("_read",)
    _read: Callable[[str, RoadObservation], Mapping[str, Any]]

    def __init__(
        self,
        time: float,
        index: Int32Array,
        read: Callable[[str, RoadObservation], Mapping[str, Any]],
    ) -> None:
        self._set_fields({"time": time, "index": index, "_read": read})

    def __getattr__(self, name: str) -> Any:
        # Python asks here for slots that hold nothing yet.
        if name not in _FIELDS:
            raise AttributeError(f"an observation has no {name!r}")
        self._set_fields(self._read(name, self))
        return object.__getattribute__(self, name)

    def read_all(self) -> None:
        """Read what has not been looked at."""
        for name in _FIELDS:
            getattr(self, name)

    def _set_fields(self, values: Mapping[str, Any]) -> None:
        for name, value in values.items():
            object.__setattr__(self, name, value)  # it is frozen for everyone else
