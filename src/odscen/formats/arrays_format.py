"""A scenario as arrays in an .npz without pickles, with the graphs of its map; and back.

Names, units and types are in ``docs/learning-formats.md``; ``odscen import`` reads what somebody
has changed or made of it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from odscen.base.errors import InputError
from odscen.formats.base import FileContent, Format

if TYPE_CHECKING:
    from odscen.formats.base import ExportFiles, ExportSource, ImportSource


def write_scenario_arrays(source: ExportSource) -> ExportFiles:
    """One .npz file.

    Raises
    ------
    ScenarioError
        If the scenario was made on another map.
    """
    from odscen.base.given_arrays import npz_bytes
    from odscen.scenario.forms.array_form import to_arrays

    return {f"{source.name}.npz": npz_bytes(to_arrays(source.scenario, source.sumo_map.graph))}


def read_scenario_arrays(source: ImportSource) -> FileContent:
    """The scenario of an .npz file; of unchanged arrays the same, byte for byte.

    Raises
    ------
    InputError
        If a map is given beside it, or the file is none of ours.
    ScenarioError
        If a value is not possible; names each with its array and row.
    """
    from odscen.scenario.forms.any_form import read_any

    if source.map_given:
        raise InputError(
            "--maps and --map are for OpenSCENARIO; arrays name a map of the workspace",
            file=source.file.where,
        )
    return FileContent(read_any(source.file.read(), file=source.file.where))


FORMAT = Format(
    id="arrays",
    title="Arrays (.npz)",
    label="arrays of a scenario and its map, which odscen import reads back (.npz)",
    description="Columns of road users and the graphs of the map as NumPy arrays; they can be "
    "changed and imported again.",
    of=("scenario",),
    suffixes=(".npz",),
    read=read_scenario_arrays,
    write=write_scenario_arrays,
    checked=False,
)
