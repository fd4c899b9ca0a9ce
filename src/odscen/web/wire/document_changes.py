"""What an edit has changed of a document, as operations of JSON Patch (RFC 6902).

A document with thousands of road users is half a megabyte; an edit changes a few numbers of it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal

from pydantic import BaseModel
from typing_extensions import TypeAliasType

from odscen.web.messages import Answer, ProblemInfo

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from odscen.scenario.document.scenario_document import Scenario

MOST_OF_A_LIST = 0.5
"""Share of a list's entries that may be added or removed one by one; beyond, all are sent."""

JsonPart = TypeAliasType(
    "JsonPart", "str | int | float | bool | list[JsonPart] | dict[str, JsonPart] | None"
)
"""Any part of a document, as JSON."""


class DocumentChange(Answer):
    """One operation of JSON Patch; ``path`` is a JSON pointer, ``value`` is null for ``remove``."""

    op: Literal["add", "remove", "replace"]
    path: str
    value: JsonPart = None


class ScenarioPatch(Answer):
    """What has become of a scenario since the version that was asked to change.

    ``changes`` make the document of ``version`` from that of ``before``, in their order; problems
    are asked for apart.
    """

    name: str
    before: int
    version: int
    changes: list[DocumentChange]
    label: str
    undo: str | None
    redo: str | None


class ScenarioProblems(Answer):
    """What is wrong with a scenario at a version."""

    version: int
    problems: list[ProblemInfo]


def changes_between(before: Scenario, after: Scenario) -> list[DocumentChange]:
    """Operations that make the JSON of one document from that of another.

    Parts that both have as the same object take no time, as edits leave them.
    """
    changes: list[DocumentChange] = []
    for name in type(before).model_fields:
        old, new = getattr(before, name), getattr(after, name)
        if old is new or old == new:
            continue
        if not (isinstance(old, tuple) and isinstance(new, tuple)):
            # As the document writes it: a part alone may be written otherwise.
            pair = (before, after)
            old, new = (document.model_dump(mode="json", include={name})[name] for document in pair)
        changes += _list_changes(old, new, f"/{name}")
    return changes


def _list_changes(before: Any, after: Any, path: str) -> Iterator[DocumentChange]:
    if isinstance(before, BaseModel) and isinstance(after, BaseModel):
        if before is not after and before != after:
            yield from _list_changes(_json_value(before), _json_value(after), path)
    elif isinstance(before, dict) and isinstance(after, dict):
        yield from _changes_of_table(before, after, path)
    elif isinstance(before, list | tuple) and isinstance(after, list | tuple):
        yield from _changes_of_list(before, after, path)
    elif type(before) is not type(after) or before != after:
        yield _replace_change(after, path)


def _changes_of_table(
    before: dict[str, Any], after: dict[str, Any], path: str
) -> Iterator[DocumentChange]:
    if [key for key in before if key in after] != list(after)[: len(before.keys() & after.keys())]:
        yield _replace_change(after, path)  # JSON Patch cannot put keys in order, which people see
        return
    for key in before:
        if key not in after:
            yield DocumentChange(op="remove", path=f"{path}/{_escape_key(key)}")
    for key, value in after.items():
        place = f"{path}/{_escape_key(key)}"
        if key in before:
            yield from _list_changes(before[key], value, place)
        else:
            yield DocumentChange(op="add", path=place, value=value)


def _changes_of_list(
    before: Sequence[Any], after: Sequence[Any], path: str
) -> Iterator[DocumentChange]:
    """Entries are followed by their ids; without ids, or in another order, the list is sent."""
    old, new = _rows_by_id(before), _rows_by_id(after)
    if old is None or new is None or [k for k in old if k in new] != [k for k in new if k in old]:
        if _json_value(before) != _json_value(after):
            yield _replace_change(after, path)
        return
    gone = [row for key, row in old.items() if key not in new]
    fresh = sum(key not in old for key in new)
    if len(gone) + fresh > 1 and len(gone) + fresh > MOST_OF_A_LIST * len(before):
        yield _replace_change(after, path)
        return
    for row in reversed(gone):
        yield DocumentChange(op="remove", path=f"{path}/{row}")
    for key, row in new.items():
        if key in old:
            yield from _list_changes(before[old[key]], after[row], f"{path}/{row}")
        else:
            yield DocumentChange(op="add", path=f"{path}/{row}", value=_json_value(after[row]))


def _rows_by_id(entries: Sequence[Any]) -> dict[str, int] | None:
    """Rows of entries by their ids; ``None`` if they have none, or share one."""
    rows = {key: row for row, key in enumerate(map(_entry_id, entries)) if isinstance(key, str)}
    return rows if len(rows) == len(entries) else None


def _entry_id(entry: Any) -> Any:
    if isinstance(entry, str):
        return entry
    return entry.get("id") if isinstance(entry, dict) else getattr(entry, "id", None)


def _replace_change(value: Any, path: str) -> DocumentChange:
    return DocumentChange(op="replace", path=path, value=_json_value(value))


def _json_value(value: Any) -> Any:
    if isinstance(value, BaseModel):
        return value.model_dump(mode="json")
    return [_json_value(item) for item in value] if isinstance(value, list | tuple) else value


def _escape_key(key: str) -> str:
    return key.replace("~", "~0").replace("/", "~1")
