"""What a run of SUMO is made of beside what every run is: its files, and what it will need."""

from __future__ import annotations

import os
import shutil
from dataclasses import dataclass, field
from functools import cache
from importlib.metadata import version
from typing import TYPE_CHECKING

from odscen.runs import layout
from odscen.runs.new_run import PreparedRun
from odscen.sumo.outputs.signal_log import signal_logs

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from odscen.sumo.runner.forecast import Forecast


@cache
def sumo_version() -> str:
    """Version of the SUMO that runs are made with."""
    return version("libsumo")


@dataclass(frozen=True, slots=True, kw_only=True)
class SumoPreparedRun(PreparedRun):
    """A prepared run with SUMO's files; nothing on disk yet but the network.

    Attributes
    ----------
    sumo_files
        Text by file name: routes, configuration and perhaps signals, from
        :func:`odscen.sumo.realize.realization.realize`.
    net
        SUMO network file of the map.
    expected
        What it will need on disk and in memory.
    """

    sumo_files: Mapping[str, str]
    net: Path
    expected: Forecast | None = None
    versions: Mapping[str, str] = field(default_factory=lambda: {"sumo": sumo_version()})

    def write(self, folder: Path) -> None:
        """Write what the run starts from, the SUMO files included."""
        PreparedRun.write(self, folder)  # with slots, super() has no class to start from
        sumo = folder / layout.SUMO_FOLDER
        sumo.mkdir()
        write_sumo_files(self.sumo_files, self.net, sumo, link=True)


def write_sumo_files(files: Mapping[str, str], net: Path, folder: Path, *, link: bool) -> None:
    """Write the SUMO files and the network into ``folder``.

    With ``link`` the network is a hard link where the file system has them: many runs on one map
    then hold it once. What a user takes away should be a copy.
    """
    for name, text in sorted(files.items()):
        (folder / name).write_text(text, encoding="utf-8")
    target = folder / layout.NET_FILE
    if link:
        try:
            os.link(net, target)
        except OSError:
            pass
        else:
            return
    shutil.copyfile(net, target)


def drop_torn_records(folder: Path) -> None:
    """Remove Parquet files without their end, and what SUMO wrote that was not made into tables.

    A killed run leaves them, and nothing can read them.
    """
    for name in (layout.LANES_FILE, layout.EMISSIONS_FILE, layout.TRIPINFO_FILE, layout.SSM_FILE):
        (folder / name).unlink(missing_ok=True)
    for log in signal_logs(folder):
        log.unlink(missing_ok=True)
    file = folder / layout.TRAJECTORIES_FILE
    if not file.is_file():
        return
    with file.open("rb") as opened:
        opened.seek(max(0, file.stat().st_size - 4))
        whole = opened.read() == b"PAR1"
    if not whole:
        file.unlink()
