"""SUMO: routes, configuration and network, which run with plain ``sumo -c``."""

from __future__ import annotations

from typing import TYPE_CHECKING

from odscen.base.errors import InputError
from odscen.formats.base import Format

if TYPE_CHECKING:
    from collections.abc import Sequence

    from odscen.formats.base import (
        ExportFiles,
        ExportSource,
        FileContent,
        GivenFile,
        ImportSource,
    )


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


def choose_configuration(files: Sequence[GivenFile]) -> int:
    """Of the files of a project the configuration, or else the network.

    Raises
    ------
    InputError
        If there is neither.
    """
    for ending in (".sumocfg", ".sumo.cfg", ".net.xml", ".net.xml.gz"):
        for index, file in enumerate(files):
            if file.name.lower().endswith(ending):
                return index
    raise InputError("none of the files is a SUMO configuration (.sumocfg) or network (.net.xml)")


def read_project(source: ImportSource) -> FileContent:
    """Read a SUMO project as a scenario."""
    from odscen.formats.sumo_project import read_sumo_project

    return read_sumo_project(source)


FORMAT = Format(
    id="sumo",
    title="SUMO",
    label="SUMO files that run with plain sumo -c",
    description="Network, routes and configuration, which run with plain sumo -c.",
    of=("scenario",),
    suffixes=(".sumocfg", ".sumo.cfg", ".net.xml", ".net.xml.gz"),
    read=read_project,
    choose_main=choose_configuration,
    write=write_sumo_files,
)
