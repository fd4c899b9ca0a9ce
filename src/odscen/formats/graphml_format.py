"""GraphML of a scenario's graph form, see :mod:`odscen.scenario.forms.graph_form`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from odscen.formats.base import Format

if TYPE_CHECKING:
    from odscen.formats.base import ExportFiles, ExportSource


def write_graph_form(source: ExportSource) -> ExportFiles:
    """One ``.graphml`` file with the name of the scenario's.

    Raises
    ------
    ScenarioError
        If the graph cannot carry the scenario.
    """
    from odscen.scenario.forms.graph_form import to_graphml

    text = to_graphml(source.scenario, source.sumo_map.graph)
    return {f"{source.name}.graphml": text}


FORMAT = Format(
    id="graphml",
    title="GraphML",
    label="the graph form as GraphML",
    description="The lane graph with the scenario on it, for networkx and other graph tools.",
    of=("scenario",),
    write=write_graph_form,
    checked=False,
)
