"""Two scenario documents held against each other, field by field, in words."""

from __future__ import annotations

import json
from collections import Counter
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from odscen.base.shown import shown_id

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from odscen.changes.map_change import ChangeKind
    from odscen.scenario.document.scenario_document import Scenario

_LONGEST = 80
_NAMES = ("id", "junction")
"""Fields by which entries of lists are paired."""
_NTH = "#"
"""Before the number of an entry of a list, from 1 on, in the place of a change."""
_SINGULAR = {
    "actors": "actor",
    "flows": "flow",
    "rules": "rule",
    "zones": "zone",
    "profiles": "profile",
    "inputs": "vehicle input",
    "matrices": "matrix",
    "counts": "counts",
    "background": "background demand",
    "lines": "line",
    "stops": "stop",
    "measures": "measure",
    "detectors": "detector",
    "sections": "travel-time section",
    "cordons": "cordon",
    "junctions": "junction",
}


@dataclass(frozen=True, slots=True)
class ScenarioChange:
    """A difference of two documents; ``before`` and ``after`` as JSON, ``None`` where nothing is.

    ``place`` is the path of the field, with the ids of actors, flows and the like:
    ``("actors", "van-1", "goal")``; entries without an id by their number, ``"#1"``.
    """

    kind: ChangeKind
    place: tuple[str, ...]
    before: str | None = None
    after: str | None = None

    @property
    def words(self) -> str:
        """One line for people: ``actor van-1, goal: "5.0.-1.3" -> "7.0.-1.9"``."""
        if self.before is None or self.after is None:
            value = self.after or self.before
            in_brackets = f" ({value})" if value else ""
            return f"{self._describe_subject()}: {self.kind}{in_brackets}"
        return f"{self._describe_subject()}: {self.before} -> {self.after}"

    def _describe_subject(self) -> str:
        phrases: list[str] = []
        parts = iter(self.place)
        for part in parts:
            if part.startswith(_NTH):
                phrases[-1] += f" {part.removeprefix(_NTH)}"
                continue
            key = next(parts, None) if part in _SINGULAR else None
            name = part.replace("_", " ")
            phrases.append(name if key is None else f"{_SINGULAR[part]} {shown_id(key)}")
        return ", ".join(phrases)

    def to_dict(self) -> dict[str, Any]:
        """JSON-ready."""
        return {
            "kind": self.kind,
            "place": list(self.place),
            "before": self.before,
            "after": self.after,
            "words": self.words,
        }


def scenario_differences(before: Scenario, after: Scenario) -> tuple[ScenarioChange, ...]:
    """Find the differences of two scenarios, in the order of the fields of the document.

    Actors, flows and whatever else has an id are paired by it, so their order is told apart from
    their content. Others are paired by their place where there are as many as before.
    """
    old, new = (scenario.model_dump(mode="json") for scenario in (before, after))
    return tuple(field_differences(old, new))


def field_differences(old: Mapping[str, Any], new: Mapping[str, Any]) -> Iterator[ScenarioChange]:
    """Find the differences of two documents as plain data, in the order of their fields."""
    yield from _compare_fields(old, new, ())


def _compare_fields(
    old: Mapping[str, Any], new: Mapping[str, Any], place: tuple[str, ...]
) -> Iterator[ScenarioChange]:
    for key in dict.fromkeys([*old, *new]):
        yield from _compare_values(old.get(key), new.get(key), (*place, key))


def _compare_values(old: Any, new: Any, place: tuple[str, ...]) -> Iterator[ScenarioChange]:
    if old == new:
        return
    if isinstance(old, dict) and isinstance(new, dict):
        yield from _compare_fields(old, new, place)
    elif isinstance(old, list) and isinstance(new, list):
        entries = (*old, *new)
        name = next(
            (key for key in _NAMES if all(isinstance(row, dict) and key in row for row in entries)),
            None,
        )
        if name is not None:
            yield from _compare_by_name(old, new, place, name)
        elif len(old) == len(new) and all(isinstance(row, dict) for row in entries):
            for number, (before, after) in enumerate(zip(old, new, strict=True), start=1):
                yield from _compare_values(before, after, (*place, f"{_NTH}{number}"))
        else:
            yield ScenarioChange("changed", place, *_shorten_lists(old, new))
    else:
        yield ScenarioChange("changed", place, _format_value(old), _format_value(new))


def _compare_by_name(
    old: Sequence[dict[str, Any]], new: Sequence[dict[str, Any]], place: tuple[str, ...], name: str
) -> Iterator[ScenarioChange]:
    was = {part[name]: part for part in old}
    now = {part[name]: part for part in new}
    for key, content in was.items():
        if key in now:
            yield from _compare_fields(content, now[key], (*place, key))
        else:
            yield ScenarioChange("removed", (*place, key), _describe_timing(content, name))
    for key, content in now.items():
        if key not in was:
            yield ScenarioChange("added", (*place, key), None, _describe_timing(content, name))
    if [key for key in was if key in now] != [key for key in now if key in was]:
        yield ScenarioChange("changed", (*place, "order"), "as it was", "another")


def _describe_timing(part: Mapping[str, Any], name: str) -> str | None:
    """What is given of a light, which has its map's program otherwise."""
    if name != "junction":
        return None
    return _format_value({key: value for key, value in part.items() if value and key != name})


def _shorten_lists(old: Sequence[Any], new: Sequence[Any]) -> tuple[str, str]:
    """Short lists whole; of long ones only what is not in the other, with how many it is."""
    values = _format_value(old), _format_value(new)
    if max(map(len, values)) <= _LONGEST:
        return values
    first, second = (Counter(json.dumps(item) for item in these) for these in (old, new))
    lost, gained = first - second, second - first
    return _describe_count(old, lost), _describe_count(new, gained)


def _describe_count(these: Sequence[Any], own: Counter[str]) -> str:
    return f"{len(these)} values, of them {sum(own.values())} only here"


def _format_value(value: Any) -> str:
    text = json.dumps(value, ensure_ascii=True)
    return text if len(text) <= _LONGEST or isinstance(value, list) else text[:_LONGEST] + "..."
