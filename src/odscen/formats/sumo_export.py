"""SUMO: routes, configuration and network, which run with plain ``sumo -c``."""

from __future__ import annotations

from typing import TYPE_CHECKING

from odscen.formats.exporter import Exporter

if TYPE_CHECKING:
    from odscen.formats.exporter import ExportFiles, ExportSource


def sumo_files(source: ExportSource) -> ExportFiles:
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


EXPORTER = Exporter(name="sumo", label="SUMO files that run with plain sumo -c", files=sumo_files)
