"""``odscen maps network`` and ``odscen maps compare``: the SUMO networks of a map."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from odscen.base.errors import InputError
from odscen.cli.console import (
    JsonOption,
    WorkspaceOption,
    log,
    print_json,
    print_table,
    progress,
)

if TYPE_CHECKING:
    from odscen.app.networks import BroughtIn

_SHOWN = 40
"""Changes shown; JSON has all of them."""


def network(
    name: Annotated[str, typer.Argument(metavar="NAME")],
    source: Annotated[
        Path | None,
        typer.Option("--from", help="Network to bring in for the map.", metavar="FILE.net.xml"),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(help="Write the map's network there.", metavar="FILE.net.xml"),
    ] = None,
    workspace: WorkspaceOption = None,
    as_json: JsonOption = False,
) -> None:
    """Show or write a map's SUMO network, or bring one in that was changed in netedit.

    With --from the lane table is made anew by geometry, and what is different from the network
    before is listed. The network stays that of the map until: odscen maps add --converter.
    """
    from odscen.app.networks import bring_in
    from odscen.base.text_files import write_text
    from odscen.workspace.store import Workspace

    if source is not None and out is not None:
        msg = "give either --from, to bring a network in, or --out, to write the map's"
        raise InputError(msg)
    store = Workspace.open(workspace)
    if source is not None:
        with progress(name) as step:
            done = bring_in(store, name, source, progress=step)
        _print_changes(done, as_json=as_json)
        return
    entry = store.map(name)
    path = entry.path("net")
    if out is not None:
        write_text(out, path.read_text(encoding="utf-8"))
        log(f"Wrote {out}")
    if as_json:
        print_json({"name": name, "file": str(out or path), **entry.info["network"]})
    elif out is None:
        made = entry.info["network"]
        log(f"{name}: network by {made['source'] or made['converter']}")
        typer.echo(str(path))


def _print_changes(done: BroughtIn, *, as_json: bool) -> None:
    entry, changes = done
    counts = Counter(change.what for change in changes)
    if as_json:
        print_json(
            {
                "name": entry.name,
                "network": entry.info["network"],
                "counts": dict(counts),
                "changes": [change._asdict() for change in changes],
            }
        )
        return
    said = ", ".join(f"{count} x {what}" for what, count in counts.items())
    log(f"{entry.name}: network {entry.info['network']['source']}; {said or 'no difference'}")
    if changes:
        print_table("", ("what", "element", "detail"), [tuple(one) for one in changes[:_SHOWN]])
    if len(changes) > _SHOWN:
        log(f"and {len(changes) - _SHOWN} more; --json lists all")
