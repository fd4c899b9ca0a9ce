"""Which segment, junction and movement each SUMO lane belongs to, for sums over lanes.

Made from a map by :mod:`odscen.sumo.realize.sumo_lane_places` and kept in the run folder, so that
figures can be had from a run alone.
"""

from __future__ import annotations

import json
from dataclasses import dataclass, fields
from functools import lru_cache
from typing import TYPE_CHECKING

from odscen.base.stored_files import stored_document

if TYPE_CHECKING:
    import polars as pl

_FORMAT = "odscen-lane-places"
_VERSION = 1


@dataclass(frozen=True, slots=True, eq=False)
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

    lanes: pl.DataFrame
    ways: pl.DataFrame
    segments: pl.DataFrame
    junctions: pl.DataFrame
    movements: pl.DataFrame

    def to_json(self) -> str:
        """One JSON document, columns as lists."""
        return _to_json(self)

    @classmethod
    def from_json(cls, text: str) -> LanePlaces:
        """Inverse of :meth:`to_json`.

        Raises
        ------
        InputError
            If it is not such a document of this version.
        """
        return _from_json(text)

    @classmethod
    def of(cls, **tables: object) -> LanePlaces:
        """Make it from columns or rows of each table."""
        import polars as pl

        schemas = _schemas()
        return cls(
            **{
                name: pl.DataFrame(data, schema=schemas[name], orient="row")  # type: ignore[arg-type]
                for name, data in tables.items()
            }
        )


@lru_cache(maxsize=4)
def _to_json(places: LanePlaces) -> str:
    """One text for all runs on a map."""
    tables = {f.name: getattr(places, f.name).to_dict(as_series=False) for f in fields(places)}
    data = {"format": _FORMAT, "version": _VERSION, **tables}
    return json.dumps(data, separators=(",", ":"), allow_nan=False)


@lru_cache(maxsize=4)
def _from_json(text: str) -> LanePlaces:
    """Runs on one map have the same text, and what follows from it is kept with the places."""
    import polars as pl

    with stored_document(
        text,
        pl.exceptions.PolarsError,
        form=_FORMAT,
        version=_VERSION,
        what="the places of lanes",
    ) as data:
        return LanePlaces.of(**{field.name: data[field.name] for field in fields(LanePlaces)})


def _schemas() -> dict[str, dict[str, type[pl.DataType]]]:
    import polars as pl

    place = {"junction": pl.String, "control": pl.String, "length": pl.Float64}
    return {
        "lanes": {
            "lane": pl.String,
            "length": pl.Float64,
            "motor": pl.Boolean,
            "segment": pl.String,
            "share": pl.Float64,
            "entry": pl.Boolean,
        },
        "ways": dict.fromkeys(
            ("lane", "junction", "approach", "source", "via", "movement"), pl.String
        ),
        "segments": {"segment": pl.String, "length": pl.Float64},
        "junctions": place,
        "movements": {"movement": pl.String, **place},
    }
