"""JSON Patch (RFC 6902) as far as the server uses it, read the way the standard says."""

from __future__ import annotations

import copy
from typing import Any


def patched(document: Any, operations: list[dict[str, Any]]) -> Any:
    """What ``operations`` make of a document."""
    document = copy.deepcopy(document)
    for one in operations:
        *way, last = [
            token.replace("~1", "/").replace("~0", "~") for token in one["path"].split("/")[1:]
        ]
        place = document
        for token in way:
            place = place[int(token) if isinstance(place, list) else token]
        if isinstance(place, list):
            _in_list(place, int(last), one)
        elif one["op"] == "remove":
            del place[last]
        else:
            assert (last in place) == (one["op"] == "replace"), one
            place[last] = one["value"]
    return document


def _in_list(place: list[Any], row: int, one: dict[str, Any]) -> None:
    assert 0 <= row < len(place) + (one["op"] == "add"), one
    if one["op"] == "add":
        place.insert(row, one["value"])
    elif one["op"] == "remove":
        del place[row]
    else:
        place[row] = one["value"]
