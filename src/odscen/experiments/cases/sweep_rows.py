"""One run of a sweep as a row: collisions of those who matter, and how close they came."""

from __future__ import annotations

import operator
import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from odscen.base.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterable, Mapping, Sequence

    import polars as pl

    from odscen.records.run_events import Event

OUTCOME: Final = ("collision", "impact_speed", "min_ttc", "min_pet", "max_drac")
"""Columns of a row about how it went: whether, m/s, s, s, m/s^2; of those who are watched."""
UNITS: Final = {"impact_speed": "m/s", "min_ttc": "s", "min_pet": "s", "max_drac": "m/s²"}
_NEAR: Final = 1e-6
_OPERATORS: Final[dict[str, Callable[[float, float], bool]]] = {
    ">=": operator.ge, "<=": operator.le, ">": operator.gt, "<": operator.lt,
}  # fmt: skip
_LIMIT = re.compile(r"\s*([A-Za-z_]\w*)\s*(>=|<=|>|<)\s*([+-]?\d+(?:\.\d+)?(?:[eE][+-]?\d+)?)\s*")


@dataclass(frozen=True, slots=True)
class Limit:
    """What a case needs to be safe besides no collision: ``min_ttc >= 1.5``.

    A measure that a case does not have, as two never came near each other, is no breach.
    """

    column: str
    op: str
    bound: float

    def holds(self, row: Mapping[str, Any]) -> bool:
        """Whether a row keeps it."""
        value = row[self.column]
        return value is None or _OPERATORS[self.op](float(value), self.bound)

    def __str__(self) -> str:
        return f"{self.column} {self.op} {self.bound:g}"


def limit_from_text(text: str, columns: Sequence[str]) -> Limit:
    """Read a limit.

    Raises
    ------
    InputError
        If it is none, or there is no such column.
    """
    match = _LIMIT.fullmatch(text)
    if match is None:
        raise InputError(f"{text!r} is no limit; write for example: min_ttc >= 1.5")
    if match[1] not in columns:
        raise InputError(
            f"{text!r}: a sweep has no column {match[1]!r}; it has {', '.join(columns)}"
        )
    return Limit(match[1], match[2], float(match[3]))


def outcome_of(
    events: Iterable[Event],
    conflicts: pl.DataFrame | None,
    trajectories: Callable[[], pl.DataFrame],
    watched: Collection[str] | None,
) -> dict[str, bool | float | None]:
    """Collisions and closest encounters of some road users; keys are :data:`OUTCOME`.

    Parameters
    ----------
    events
        Of the run.
    conflicts
        Of the run, as :func:`odscen.figures.measures.conflicts.conflict_table` gives them.
    trajectories
        Called where the speed of an impact is not in its event.
    watched
        Ids of whose; ``None`` is everybody's.
    """
    impacts: list[float] = []
    for event in events:
        if event.kind == "collision" and _of(watched, event.actor, event.partner):
            known = (event.values or {}).get("impact_speed")
            impacts.append(_closing(event, trajectories()) if known is None else float(known))
    found: dict[str, bool | float | None] = {
        "collision": bool(impacts),
        "impact_speed": max(impacts, default=None),
    }
    rows = [] if conflicts is None else conflicts.to_dicts()
    own = [row for row in rows if _of(watched, row["one"], row["other"])]
    for name, column, best in (
        ("min_ttc", "ttc", min), ("min_pet", "pet", min), ("max_drac", "drac", max),
    ):  # fmt: skip
        found[name] = best((row[column] for row in own if row[column] is not None), default=None)
    return found


def _of(watched: Collection[str] | None, *ids: str | None) -> bool:
    return watched is None or any(one in watched for one in ids)


def _closing(event: Event, trajectories: pl.DataFrame) -> float:
    """Relative speed of the two of a collision at its record, m/s; NaN if they have none."""
    import polars as pl

    pair = trajectories.filter(
        pl.col("id").is_in([event.actor, event.partner]),
        (pl.col("time") - event.time).abs() < _NEAR,
    )
    if pair.height != 2:
        return float("nan")
    heading, speed = pair["hdg"].to_numpy(), pair["speed"].to_numpy()
    return float(np.hypot(*np.diff(speed * np.vstack([np.cos(heading), np.sin(heading)])).ravel()))
