"""Which segment, junction and movement each SUMO lane belongs to, for sums over lanes.

Made from a map by :mod:`odscen.sumo.realize.sumo_lane_places` and kept in the run folder, so that
figures can be had from a run alone.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, Any

from odscen.base.stored_files import stored_document

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    import polars as pl

_FORMAT = "odscen-lane-places"
_VERSION = 1
_PLACE = {"junction": str, "control": str, "length": float}
_COLUMNS: dict[str, dict[str, type]] = {
    "lanes": {
        "lane": str,
        "length": float,
        "motor": bool,
        "segment": str,
        "share": float,
        "entry": bool,
    },
    "ways": dict.fromkeys(("lane", "junction", "approach", "source", "via", "movement"), str),
    "segments": {"segment": str, "length": float},
    "junctions": _PLACE,
    "movements": {"movement": str, **_PLACE},
}


@dataclass(frozen=True, eq=False)
class LanePlaces:
    """Tables about the lanes that vehicles may use; metres.

    Attributes
    ----------
    lanes
        One row for each lane and segment: ``lane``, its ``length``, whether ``motor`` vehicles may
        use it, ``segment``, ``share`` of the lane that lies in the segment, and ``entry``: whether
        one comes into the segment by its edge.
    ways
        One row for each lane that leads to a junction or through it: ``lane``, ``junction``,
        ``approach`` (the last edge before the junction), and inside of the junction also
        ``source`` (the lane of that edge that one comes from), ``via`` (the first lane inside) and
        ``movement``; null on the way to it.
    segments
        ``segment`` and ``length`` along the road; junctions are not among them.
    junctions
        ``junction``, ``control`` ("signal" or "priority"), and the mean ``length`` of the ways
        through.
    movements
        ``movement`` (``r1>j10>r2``), ``junction``, ``control``, and the mean ``length`` of its
        ways.
    """

    columns: Mapping[str, Mapping[str, Sequence[Any]]]
    """Of each table: what a run writes, which then need not wait for a library for tables."""

    @cached_property
    def lanes(self) -> pl.DataFrame:
        return self._make_table("lanes")

    @cached_property
    def ways(self) -> pl.DataFrame:
        return self._make_table("ways")

    @cached_property
    def segments(self) -> pl.DataFrame:
        return self._make_table("segments")

    @cached_property
    def junctions(self) -> pl.DataFrame:
        return self._make_table("junctions")

    @cached_property
    def movements(self) -> pl.DataFrame:
        return self._make_table("movements")

    def to_json(self) -> str:
        """One JSON document, columns as lists."""
        return _write_json(self)

    @classmethod
    def from_json(cls, text: str) -> LanePlaces:
        """Inverse of :meth:`to_json`.

        Raises
        ------
        InputError
            If it is not such a document of this version.
        """
        return _read_json(text)

    @classmethod
    def of(cls, **tables: Iterable[Sequence[object]]) -> LanePlaces:
        """Make it from rows of each table."""
        columns = {}
        for name, rows in tables.items():
            kinds = _COLUMNS[name]
            values = list(zip(*rows, strict=True)) or [()] * len(kinds)
            columns[name] = {
                column: [None if value is None else kind(value) for value in some]
                for (column, kind), some in zip(kinds.items(), values, strict=True)
            }
        return cls(columns)

    def _make_table(self, name: str) -> pl.DataFrame:
        import polars as pl

        types = {str: pl.String, float: pl.Float64, bool: pl.Boolean}
        schema = {column: types[kind] for column, kind in _COLUMNS[name].items()}
        return pl.DataFrame(self.columns[name], schema=schema)


@lru_cache(maxsize=4)
def _write_json(places: LanePlaces) -> str:
    """One text for all runs on a map."""
    data = {"format": _FORMAT, "version": _VERSION, **places.columns}
    return json.dumps(data, separators=(",", ":"), allow_nan=False)


@lru_cache(maxsize=4)
def _read_json(text: str) -> LanePlaces:
    """Runs on one map have the same text, and what follows from it is kept with the places."""
    import polars as pl

    with stored_document(
        text,
        pl.exceptions.PolarsError,
        form=_FORMAT,
        version=_VERSION,
        what="the places of lanes",
    ) as data:
        places = LanePlaces({name: data[name] for name in _COLUMNS})
        for name in _COLUMNS:
            getattr(places, name)  # what does not fit is found here
        return places
