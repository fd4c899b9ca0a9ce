"""A scenario as arrays in an .npz without pickles, with the graphs of its map; and back.

Names, units and types are in ``docs/learning-formats.md``; ``odscen import`` reads what somebody
has changed or made of it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from odscen.formats.exporter import Exporter

if TYPE_CHECKING:
    from odscen.formats.exporter import ExportFiles, ExportSource


def scenario_array_files(source: ExportSource) -> ExportFiles:
    """One .npz file.

    Raises
    ------
    ScenarioError
        If the scenario was made on another map.
    """
    from odscen.base.given_arrays import npz_bytes
    from odscen.scenario.forms.array_form import to_arrays

    return {f"{source.name}.npz": npz_bytes(to_arrays(source.scenario, source.sumo_map.graph))}


EXPORTER = Exporter(
    name="arrays",
    label="arrays of a scenario and its map, which odscen import reads back (.npz)",
    files=scenario_array_files,
    checked=False,
)
