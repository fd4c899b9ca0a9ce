"""``odscen maps network`` and ``odscen maps compare``: the SUMO networks of a map."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from odscen.base.errors import InputError
from odscen.cli.console import (
    BuildMemoryOption,
    BuildMinutesOption,
    JsonOption,
    WorkspaceOption,
    log,
    print_json,
    print_table,
    progress,
)

if TYPE_CHECKING:
    from odscen.app.map_comparison import ConvertedMap, MapComparison
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
    memory: BuildMemoryOption = None,
    minutes: BuildMinutesOption = None,
    workspace: WorkspaceOption = None,
    as_json: JsonOption = False,
) -> None:
    """Show or write a map's SUMO network, or bring one in that was changed in netedit.

    With --from the lane table is made anew by geometry, and what is different from the network
    before is listed. The network stays that of the map until: odscen maps add --converter.
    """
    from odscen.app.networks import bring_in
    from odscen.base.text_files import write_text
    from odscen.maps.allowances import BuildLimits
    from odscen.maps.store import Workspace

    if source is not None and out is not None:
        raise InputError("give either --from, to bring a network in, or --out, to write the map's")
    store = Workspace.open(workspace)
    if source is not None:
        with progress(name) as step:
            limits = BuildLimits(memory, minutes)
            done = bring_in(store, name, source, limits=limits, progress=step)
        _print_changes(done, as_json=as_json)
        return
    entry = store.map(name)
    path = entry.checked("net")
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
    listed = ", ".join(f"{count} x {what}" for what, count in counts.items())
    log(f"{entry.name}: network {entry.info['network']['source']}; {listed or 'no difference'}")
    if changes:
        print_table(
            "", ("what", "element", "detail"), [tuple(change) for change in changes[:_SHOWN]]
        )
    if len(changes) > _SHOWN:
        log(f"and {len(changes) - _SHOWN} more; --json lists all")


def compare_networks(
    name: Annotated[str, typer.Argument(metavar="NAME")],
    levels: Annotated[
        str,
        typer.Option(
            help="Trips per hour and km of lane, with commas between; empty for no runs.",
            metavar="N,...",
        ),
    ] = "100",
    seeds: Annotated[
        str, typer.Option(help="Random seeds, with commas between.", metavar="N,...")
    ] = "1",
    duration: Annotated[
        float, typer.Option(help="Seconds in which vehicles depart; the run is twice as long.")
    ] = 900.0,
    jobs: Annotated[int, typer.Option(help="Runs at a time.", min=1, max=256)] = 1,
    workspace: WorkspaceOption = None,
    as_json: JsonOption = False,
) -> None:
    """Put both converters side by side on a map: fidelity, losses, and what the networks carry."""
    from odscen.app.map_comparison import ComparisonSettings, compare_converters
    from odscen.maps.store import Workspace

    settings = ComparisonSettings(
        levels=_parse_numbers("levels", levels),
        seeds=tuple(int(seed) for seed in _parse_numbers("seeds", seeds)),
        duration=duration,
    )
    with progress(name) as step:
        comparison = compare_converters(
            Workspace.open(workspace), name, settings=settings, processes=jobs, progress=step
        )
    if as_json:
        print_json(comparison.to_dict())
    else:
        _print_comparison(comparison)


def _parse_numbers(option: str, text: str) -> tuple[float, ...]:
    try:
        return tuple(float(part) for part in text.split(",") if part.strip())
    except ValueError as error:
        raise InputError(f"--{option} takes numbers with commas between, not {text!r}") from error


def _print_comparison(found: MapComparison) -> None:
    made = [network for network in found.networks if network.entry is not None]
    for network in found.networks:
        if network.refused:
            log(f"{network.converter}: {network.refused}")
    columns = ("measure", *(network.converter for network in made))
    print_table(found.name, columns, _comparison_rows(made))
    if found.capacity:
        rows = [
            (
                f"{row.level:g}",
                what,
                *(round(getattr(row.networks[network.converter], what), 1) for network in made),
            )
            for row in found.capacity
            for what in ("planned", "arrived", "delay", "teleported", "collided")
        ]
        head = ("per hour and km", "trips; delay in s", *columns[1:])
        print_table(f"the same trips, {found.kilometres:.2f} km of lanes", head, rows)


def _comparison_rows(made: list[ConvertedMap]) -> list[tuple[str, ...]]:
    """Rows of the table of fidelity and sizes."""
    verdicts = [network.fidelity.verdicts for network in made if network.fidelity is not None]
    rows = [
        (of_all[0].name, *(f"{v.value:.4g}{'' if v.ok else ' !'}" for v in of_all))
        for of_all in zip(*verdicts, strict=True)
    ]
    infos = [network.entry.info for network in made if network.entry is not None]
    rows += [
        (f"{key} in SUMO", *(str(info["sumo"][key]) for info in infos))
        for key in ("edges", "lanes", "junctions", "crossings", "tl_logics")
    ]
    rows += [
        (f"import report, {key}", *(str(info["report"]["counts"][key]) for info in infos))
        for key in ("lost", "guessed")
    ]
    return rows
