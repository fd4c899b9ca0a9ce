"""Scenarios in any form, document, graph or arrays: every command takes all."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

from odscen.base.errors import ScenarioError
from odscen.base.shown import printable
from odscen.scenario.document.json_form import loads
from odscen.scenario.forms.graph_form import from_graphml

if TYPE_CHECKING:
    from odscen.scenario.document.scenario_document import Scenario

_ARCHIVE = b"PK\x03\x04"
"""How an .npz file begins."""


def read_any(text: str | bytes, *, file: str | None = None) -> Scenario:
    """Read a scenario from its JSON document, the GraphML of its graph form, or an .npz of arrays.

    Raises
    ------
    ScenarioError
        If it is none of these, or has problems.
    InputError
        If arrays are malformed.
    """
    if isinstance(text, bytes) and text.startswith(_ARCHIVE):
        from odscen.scenario.forms.array_reading import from_npz

        return from_npz(text, file=file)
    try:
        decoded = text if isinstance(text, str) else text.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise ScenarioError(
            f"not a scenario: byte {error.start} is not UTF-8", file=file
        ) from error
    start = decoded.removeprefix("\ufeff").lstrip()
    if start.startswith("<"):
        return from_graphml(start, file=file)
    scenario = loads(start, file=file)
    _refuse_doubled_keys(start, file)
    return scenario


def _refuse_doubled_keys(text: str, file: str | None) -> None:
    """Refuse an object that has a key twice: of the two values one would be lost in silence."""

    def refuse(pairs: list[tuple[str, Any]]) -> None:
        seen: set[str] = set()
        for key, _ in pairs:
            if key in seen:
                raise ScenarioError(
                    f"{printable(key[:60])!r} is given twice in one place", file=file
                )
            seen.add(key)

    json.loads(text, object_pairs_hook=refuse)
