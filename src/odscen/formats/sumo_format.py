"""SUMO: routes, configuration and network, which run with plain ``sumo -c``."""

from __future__ import annotations

from typing import TYPE_CHECKING

from odscen.formats.base import Format

if TYPE_CHECKING:
    from odscen.formats.base import ExportFiles, ExportSource


def write_sumo_files(source: ExportSource) -> ExportFiles:
    """Files of a run of the scenario as it is, with the network beside them.

    Raises
    ------
    ScenarioError
        With every actor and flow whose spawn or goal is not usable.
    """
    from odscen.runs.layout import NET_FILE
    from odscen.sumo.realize.realization import realize

    realization = realize(source.scenario, source.sumo_map, source.assets)
    return {**realization.files, NET_FILE: source.net}


FORMAT = Format(
    id="sumo",
    title="SUMO",
    label="SUMO files that run with plain sumo -c",
    description="Network, routes and configuration, which run with plain sumo -c.",
    of=("scenario",),
    write=write_sumo_files,
)
