"""GraphML of a scenario's graph form, see :mod:`odscen.scenario.forms.graph_form`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from odscen.formats.exporter import Exporter

if TYPE_CHECKING:
    from odscen.formats.exporter import ExportFiles, ExportSource


def graph_form(source: ExportSource) -> ExportFiles:
    """One ``.graphml`` file with the name of the scenario's.

    Raises
    ------
    ScenarioError
        If the graph cannot carry the scenario.
    """
    from odscen.scenario.forms.graph_form import to_graphml

    text = to_graphml(source.scenario, source.sumo_map.graph)
    return {f"{source.name}.graphml": text}


EXPORTER = Exporter(
    name="graphml", label="the graph form as GraphML", files=graph_form, checked=False
)
