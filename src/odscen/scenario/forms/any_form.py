"""Scenarios in either form, document or graph: every command takes both."""

from __future__ import annotations

from typing import TYPE_CHECKING

from odscen.base.errors import ScenarioError
from odscen.scenario.document.json_form import loads
from odscen.scenario.forms.graph_form import from_graphml

if TYPE_CHECKING:
    from odscen.scenario.document.scenario_document import Scenario


def read_any(text: str | bytes, *, file: str | None = None) -> Scenario:
    """Read a scenario from its JSON document or from its GraphML graph form, whichever it is.

    Raises
    ------
    ScenarioError
        If it is neither, or has problems.
    """
    try:
        decoded = text if isinstance(text, str) else text.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        msg = f"not a scenario: byte {error.start} is not UTF-8"
        raise ScenarioError(msg, file=file) from error
    start = decoded.removeprefix("\ufeff").lstrip()
    if start.startswith("<"):
        return from_graphml(start, file=file)
    return loads(start, file=file)
