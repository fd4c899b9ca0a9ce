"""``odscen maps pull``: maps of a CARLA server into the catalogue."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Annotated

import typer

from odscen.cli.console import JsonOption, WorkspaceOption, log, print_json, progress


def pull(
    names: Annotated[
        list[str] | None,
        typer.Argument(help="Maps of the server. (default: the one that it shows)"),
    ] = None,
    carla: Annotated[
        str, typer.Option(help="Where the CARLA server is.", metavar="HOST:PORT")
    ] = "127.0.0.1:2000",
    timeout: Annotated[
        float, typer.Option(min=0.5, help="Seconds that the server may take to answer.")
    ] = 10.0,
    workspace: WorkspaceOption = None,
    as_json: JsonOption = False,
) -> None:
    """Add maps of a CARLA server.

    A map has to be loaded to be fetched: naming others than the one that the server shows removes
    everything on it; the map it showed is loaded again at the end.
    """
    from odscen.base.errors import NotFoundError
    from odscen.carla.server.carla_server import Server
    from odscen.carla.server.client import Address
    from odscen.workspace.store import Workspace

    store = Workspace.open(workspace)
    rows = []
    with Server(Address.parse(carla, timeout=timeout)) as server:
        shown = server.map_name
        known = server.available_maps() if names else []
        for name in names or ():
            if name not in (shown, *known):
                raise NotFoundError("map of the server", name, known)
        try:
            for name in names or [shown]:
                if server.map_name != name:
                    server.load_map(name)
                text = server.opendrive()
                with tempfile.TemporaryDirectory() as folder, progress(name) as step:
                    file = Path(folder) / f"{name}.xodr"
                    file.write_text(text, encoding="utf-8")
                    entry = store.add_map(file, name=name, progress=step)
                nodes = entry.info["graph"]["nodes"]
                log(f"{entry.name}: {nodes:,} nodes ({entry.path('preview')})")
                rows.append({"name": entry.name, "sha256": entry.sha256, "nodes": nodes})
        finally:
            if server.map_name != shown:
                server.load_map(shown)
    if as_json:
        print_json({"maps": rows})
