"""``odscen maps``: the catalogue."""

from __future__ import annotations

import json
from collections import Counter
from dataclasses import asdict
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from odscen.base.atomic_folders import scratch_folder
from odscen.base.errors import InputError, OdscenError
from odscen.base.shown import printable
from odscen.cli.console import (
    BuildMemoryOption,
    BuildMinutesOption,
    JsonOption,
    WorkspaceOption,
    error_fields,
    log,
    option_settings,
    print_json,
    print_table,
    progress,
)

if TYPE_CHECKING:
    from collections.abc import Iterator

    from odscen.convert.verify.fidelity_result import Fidelity
    from odscen.maps.background import PicturePoint
    from odscen.maps.map_entry import MapEntry

UNITS = dict.fromkeys(
    ("bounds", "road_length", "connecting_road_length", "driving_lane_length", "spacing"), ", m"
) | dict.fromkeys(("speed_limit_min", "speed_limit_max"), ", m/s")

_WORST = 4
"""Places shown of each kind of finding; JSON has all of them."""


class ConverterChoice(StrEnum):
    """Converters that can be asked for by name."""

    ODSCEN = "odscen"
    NETCONVERT = "netconvert"


app = typer.Typer(help="Add maps, look at them, remove them.", no_args_is_help=True)


@app.command()
def add(
    files: Annotated[
        list[Path],
        typer.Argument(
            help="OpenDRIVE files, or of a format of `maps importers`.", metavar="FILE..."
        ),
    ],
    name: Annotated[
        str | None, typer.Option(help="Name in the catalogue. (default: the file's name)")
    ] = None,
    spacing: Annotated[float, typer.Option(help="Metres between nodes of the lane graph.")] = 2.0,
    converter: Annotated[
        ConverterChoice | None,
        typer.Option(
            help="Who writes the SUMO network. (default: as the map has it, odscen for a new one)"
        ),
    ] = None,
    importer: Annotated[
        str | None, typer.Option(help="Who reads the files. (default: who recognises each)")
    ] = None,
    option: Annotated[
        list[str] | None,
        typer.Option(help="A setting of the importer; repeatable.", metavar="NAME=VALUE"),
    ] = None,
    box: Annotated[
        str | None,
        typer.Option(
            help="Part of an OpenStreetMap file, in degrees; as --option box=W,S,E,N.",
            metavar="W,S,E,N",
        ),
    ] = None,
    memory: BuildMemoryOption = None,
    minutes: BuildMinutesOption = None,
    workspace: WorkspaceOption = None,
    as_json: JsonOption = False,
) -> None:
    """Add maps: build lane graph, SUMO network, statistics and drawing, once.

    A map of the same name is replaced if its content differs, and kept as it is otherwise. A file
    of another format is converted to OpenDRIVE, and kept beside the map. Files that cannot be used
    are refused with their reason; the others are added all the same. One that needs more memory or
    time than it may have is refused too, with exit code 3.
    """
    from odscen.convert.model.conversion_settings import ConversionSettings
    from odscen.maps.allowances import BuildLimits
    from odscen.maps.importers.base import ImportSettings
    from odscen.maps.store import Workspace

    if name is not None and len(files) > 1:
        raise InputError(f"--name takes one file, {len(files)} are given")
    limits = BuildLimits(memory, minutes)
    options = option_settings(option or (), element="--option")
    importing = ImportSettings(importer, options if box is None else {**options, "box": box})
    store = Workspace.open(workspace)
    rows: list[dict[str, Any]] = []
    worst = 0
    for file, map_name in zip(files, names_for(files, name), strict=True):
        try:
            with progress(map_name) as step:
                entry = store.add_map(
                    file,
                    name=map_name,
                    settings=ConversionSettings(
                        spacing=spacing, converter=converter.value if converter else None
                    ),
                    importing=importing,
                    limits=limits,
                    progress=step,
                )
        except OdscenError as error:
            worst = max(worst, error.exit_code)
            rows.append({"name": map_name, "source": str(file), "error": error_fields(error)})
            log(f"{printable(str(file))}: refused: {error}")
        else:
            rows.append({**_map_row(entry), "source": str(file)})
            if missed := entry.info.get("fidelity", {}).get("not_held"):  # not of older maps
                log(_warn_of_network(entry.name, missed))
            log(_describe_added(entry))
    if as_json:
        print_json({"maps": rows})
    raise typer.Exit(worst)


def names_for(files: list[Path], name: str | None) -> list[str]:
    """Names for the maps; files of the same name in one call also get their folder's name."""
    from odscen.maps.folder_names import name_from_file

    if name is not None:
        return [name]
    stems = Counter(name_from_file(file) for file in files)
    return [
        name_from_file(file)
        if stems[name_from_file(file)] == 1
        else name_from_file(Path(f"{file.absolute().parent.name}-{file.name}"))
        for file in files
    ]


@app.command("list")
def list_(workspace: WorkspaceOption = None, as_json: JsonOption = False) -> None:
    """List the maps with their statistics."""
    from odscen.maps.store import Workspace, is_outdated

    entries, broken = Workspace.open(workspace).catalogue()
    rows = [{**_map_row(entry), "outdated": is_outdated(entry)} for entry in entries]
    if as_json:
        print_json({"maps": rows, "broken": [asdict(broken_map) for broken_map in broken]})
    elif not rows and not broken:
        log("No maps yet. Add one with: odscen maps add FILE.xodr")
    else:
        shown = ("name", "rule", "road km", "junctions", "crosswalks", "lights", "nodes", "network")
        others = any(row["network"]["converter"] != "odscen" for row in rows)
        print_table(
            "",
            shown if others else shown[:-1],
            [
                (
                    row["name"],
                    row["opendrive"]["rule"],
                    row["statistics"]["road_length"] / 1000,
                    row["statistics"]["junctions"],
                    row["statistics"]["crosswalks"],
                    row["statistics"]["traffic_lights"],
                    row["graph"]["nodes"],
                    *((row["network"]["converter"],) if others else ()),
                )
                for row in rows
            ],
        )
    for row in rows:
        if row["outdated"]:
            log(f"outdated: {row['name']}: an earlier odscen has built it; it is rebuilt when used")
    for broken_map in broken:
        log(f"broken: {broken_map.name}: {broken_map.problem}")


@app.command()
def importers(as_json: JsonOption = False) -> None:
    """List the formats that maps can have, with the options of their importers."""
    from odscen.learning.offered_options import options_of
    from odscen.maps.importers.registry import map_importers

    usable, broken = map_importers()
    rows: list[dict[str, Any]] = [
        {
            "name": importer.name,
            "label": importer.label,
            "suffixes": list(importer.suffixes),
            "version": importer.version,
            "options": [option._asdict() for option in options_of(type(importer))],
        }
        for importer in usable.values()
    ]
    if as_json:
        print_json({"importers": rows, "broken": broken})
        return
    table = [
        (row["name"], row["label"], " ".join(row["suffixes"]),
         ", ".join(f"{option['name']}={option['usual']}" for option in row["options"]))
        for row in rows
    ]  # fmt: skip
    print_table("", ("name", "format", "files", "options"), table)
    for name, reason in broken.items():
        log(f"importer {name!r} cannot be used: {reason}")


@app.command()
def show(
    name: Annotated[str, typer.Argument(metavar="NAME")],
    workspace: WorkspaceOption = None,
    as_json: JsonOption = False,
) -> None:
    """Show a map: statistics, graph, SUMO network, files, and what was lost on the way."""
    from odscen.maps.store import Workspace

    entry = Workspace.open(workspace).map(name)
    if as_json:
        files = {key: str(entry.path(key)) for key in entry.info["files"]}
        print_json({**entry.info, "files": files})
        return
    parts = ("import", "opendrive", "statistics", "graph", "network", "sumo", "report")
    for part in (part for part in parts if part in entry.info):
        values = entry.info[part]
        if part == "report":
            values = values["counts"]
        rows = [
            (f"{key}{UNITS.get(key, '')}", _plain_value(value)) for key, value in values.items()
        ]
        print_table(part, (), rows)
    lights = [
        (", ".join(light["junctions"]) or light["id"], len(light["signals"]),
         ", ".join(f"{green:g}" for green in light["green"]), f"{light['cycle']:g}")
        for light in entry.info["lights"]
    ]  # fmt: skip
    if lights:
        columns = ("junction", "signals", "green of its stages, s", "cycle, s")
        print_table("traffic lights", columns, lights)
    log(f"Drawing: {entry.path('preview')}")


@app.command()
def render(
    name: Annotated[str, typer.Argument(metavar="NAME")],
    out: Annotated[Path, typer.Option("-o", "--out", help="File ending in .svg or .png.")],
    width: Annotated[
        int, typer.Option(help="Width of a PNG in pixels.", min=100, max=16000)
    ] = 2400,
    graph: Annotated[bool, typer.Option("--graph", help="Draw the lane graph on top.")] = False,
    picture: Annotated[
        bool, typer.Option("--picture", help="Draw the picture that lies under the map.")
    ] = False,
    workspace: WorkspaceOption = None,
    as_json: JsonOption = False,
) -> None:
    """Draw a map as SVG or PNG."""
    from odscen.maps.map_pictures import draw_map
    from odscen.maps.store import Workspace

    store = Workspace.open(workspace)
    under = store.background(name) if picture else None
    if picture and under is None:
        raise InputError(f"map {name!r} has no picture under it: odscen maps background")
    draw_map(store.map(name), out, width=width, with_graph=graph, background=under)
    log(f"Wrote {out}")
    if as_json:
        print_json({"name": name, "file": str(out)})


@app.command()
def background(
    name: Annotated[str, typer.Argument(metavar="MAP")],
    picture: Annotated[
        Path | None,
        typer.Argument(
            help="PNG, JPEG or TIFF, or tiles: a folder or .mbtiles. (default: show what MAP has)",
            metavar="PICTURE",
        ),
    ] = None,
    world: Annotated[
        Path | None,
        typer.Option(
            help="World file. (default: the one beside PICTURE, or the tags of a GeoTIFF)",
            metavar="FILE",
        ),
    ] = None,
    crs: Annotated[
        str | None,
        typer.Option(
            help="Of the world file, for example EPSG:25832. (default: metres of the map)",
            metavar="CRS",
        ),
    ] = None,
    point: Annotated[
        list[str] | None,
        typer.Option(
            help="A place in the picture, pixels, and on the map, metres; at least twice.",
            metavar="COLUMN,ROW=X,Y",
        ),
    ] = None,
    remove: Annotated[bool, typer.Option("--remove", help="Take the picture away.")] = False,
    workspace: WorkspaceOption = None,
    as_json: JsonOption = False,
) -> None:
    """Lay a picture under a map: an aerial photograph, or a plan."""
    from odscen.base.given_files import read_given_text
    from odscen.maps.store import Workspace

    store = Workspace.open(workspace)
    if remove:
        if picture is not None:
            raise InputError("--remove takes no picture")
        store.remove_background(name)
        found = None
    elif picture is not None:
        found = store.set_background(
            name,
            picture,
            world=None if world is None else read_given_text(world),
            crs=crs,
            points=[_parse_point(text) for text in point or ()],
        )
    else:
        found = store.background(name)
    if as_json:
        print_json({"map": name, "background": None if found is None else found.to_dict()})
    elif found is None:
        log(f"{name} has no picture under it")
    else:
        x0, y0, x1, y1 = found.bounds()
        log(
            f"{found.source}: {found.width} x {found.height} pixels under {name}, "
            f"x {x0:.1f} to {x1:.1f} m, y {y0:.1f} to {y1:.1f} m"
        )


def _parse_point(text: str) -> PicturePoint:
    """Read ``column,row=x,y``."""
    from odscen.maps.background import PicturePoint

    try:
        column, row, x, y = (
            float(word) for half in text.split("=", 1) for word in half.split(",", 1)
        )
    except ValueError:
        raise InputError(f"--point is COLUMN,ROW=X,Y, not {text!r}") from None
    return PicturePoint(column, row, x, y)


@app.command()
def export(
    name: Annotated[str, typer.Argument(metavar="NAME")],
    out: Annotated[Path, typer.Option("-o", "--out", help="File ending in .osm.", metavar="FILE")],
    origin: Annotated[
        str,
        typer.Option(
            help="Latitude and longitude of x = y = 0, of a map without a projection.",
            metavar="LAT,LON",
        ),
    ] = "",
    workspace: WorkspaceOption = None,
    as_json: JsonOption = False,
) -> None:
    """Write a map as Lanelet2, for Autoware and other programs that read it."""
    from odscen.base.text_files import write_file
    from odscen.maps.lanelet2_export import export_lanelet2
    from odscen.maps.store import Workspace
    from odscen.opendrive.parse import parse

    entry = Workspace.open(workspace).map(name)
    if out.suffix.lower() != ".osm":
        raise InputError(f"{out.name} does not end in .osm, as Lanelet2 files do")
    lanelet_export = export_lanelet2(parse(entry.read("xodr"), file="map.xodr"), origin=origin)
    write_file(out, lanelet_export.osm)
    for row in lanelet_export.entries:
        log(f"{row.outcome.value}: {row.element}: {row.reason}")
    log(f"Wrote {out}")
    if as_json:
        rows = [row.to_dict() for row in lanelet_export.entries]
        print_json({"name": name, "file": str(out), "entries": rows})


@app.command()
def patch(
    name: Annotated[str, typer.Argument(metavar="MAP")],
    edits: Annotated[
        Path, typer.Option(help="Edits, JSON or TOML: see docs/mending.md.", metavar="FILE")
    ],
    out: Annotated[
        str | None,
        typer.Option(help="Name of the mended map. (default: MAP is replaced)", metavar="NEW"),
    ] = None,
    anew: Annotated[
        bool, typer.Option("--anew", help="In place of the edits that MAP has.")
    ] = False,
    memory: BuildMemoryOption = None,
    minutes: BuildMinutesOption = None,
    workspace: WorkspaceOption = None,
    as_json: JsonOption = False,
) -> None:
    """Mend a map by a file of edits: widths, limits, turns, crosswalks, lights, signs, ...

    The exit code is 1 if an edit does not fit the map any more; the others are done all the same.
    """
    from odscen.maps.allowances import BuildLimits
    from odscen.maps.store import Workspace

    store = Workspace.open(workspace)
    limits = BuildLimits(memory, minutes)
    with progress(out or name) as step:
        entry = store.mend_map(name, edits, out=out, anew=anew, limits=limits, progress=step)
    rows = entry.edit_rows()
    for row in rows:
        log(f"{row['source_id']}: {row['fate']}: {row['element']}: {row['reason']}")
    if missed := entry.info["fidelity"]["not_held"]:
        log(_warn_of_network(entry.name, missed))
    if as_json:
        file = str(entry.path("xodr"))
        print_json({**_map_row(entry), "file": file, "edits": rows})
    raise typer.Exit(1 if any(row["fate"] == "lost" for row in rows) else 0)


@app.command()
def verify(
    name: Annotated[str, typer.Argument(metavar="NAME")],
    drawing: Annotated[
        Path | None,
        typer.Option(help="Draw the map with the places found, as .svg or .png.", metavar="FILE"),
    ] = None,
    workspace: WorkspaceOption = None,
    as_json: JsonOption = False,
) -> None:
    """Measure how faithfully a map's SUMO network follows its OpenDRIVE file.

    The exit code is 1 if a limit is not held.
    """
    from odscen.maps.store import Workspace

    entry = Workspace.open(workspace).map(name)
    fidelity = entry.fidelity()
    if drawing is not None:
        from odscen.maps.map_pictures import draw_fidelity

        draw_fidelity(entry, fidelity, drawing)
        log(f"Wrote {drawing}")
    if as_json:
        print_json({"name": name, **fidelity.to_dict()})
    else:
        _print_fidelity(name, fidelity)
    raise typer.Exit(0 if fidelity.passed else 1)


def _print_fidelity(name: str, fidelity: Fidelity) -> None:
    rows = [
        (
            verdict.name,
            _format_figure(verdict.value),
            f"{'at most' if verdict.at_most else 'at least'} {_format_figure(verdict.limit)}",
            "held" if verdict.ok else "NOT HELD",
        )
        for verdict in fidelity.verdicts
    ]
    print_table(name, ("measure", "found", "limit", "verdict"), rows)
    counts = [
        (f"driving lanes of SUMO, {where}", f"{found.lanes:,} lanes, {found.places:,} places")
        for where, found in (("roads", fidelity.normal), ("junctions", fidelity.internal))
    ]
    counts += [
        (f"distance, {where}", f"median {d.p50:.3f}, 95 % {d.p95:.3f}, largest {d.max:.3f} m")
        for where, d in (("roads", fidelity.normal), ("junctions", fidelity.internal))
    ]
    counts += [
        (what, f"{cover.length / 1000:.2f} km, {100 * cover.share:.2f} % covered")
        for what, cover in (
            ("drivable lanes, roads", fidelity.coverage_roads),
            ("drivable lanes, junctions", fidelity.coverage_junctions),
            ("walkable lanes", fidelity.sidewalks),
        )
    ]
    signals = fidelity.signals
    counts += [
        ("relations", f"{fidelity.relations:,}"),
        ("crosswalks", f"{fidelity.crosswalks:,}"),
        (
            "junctions with lights",
            f"{signals.opendrive} in the map, {signals.sumo} in SUMO; "
            f"lost: {', '.join(signals.lost) or 'none'}; "
            f"invented: {', '.join(signals.invented) or 'none'}",
        ),
        ("traffic lights", f"{signals.lights}; lost: {', '.join(signals.lost_lights) or 'none'}"),
    ]
    print_table("", (), counts)
    worst = list(_worst_findings(fidelity))
    if worst:
        print_table("worst places", ("what", "x, m", "y, m", "where"), worst)


def _worst_findings(fidelity: Fidelity) -> Iterator[tuple[str, float, float, str]]:
    """Give the first few findings of each kind, with their place."""
    for far in fidelity.far_places[:_WORST]:
        yield "lane aside", far.x, far.y, f"{far.metres:.2f} m, SUMO lane {far.lane}"
    for what, gaps in (
        ("lane not covered", fidelity.gaps),
        ("sidewalk not covered", fidelity.sidewalk_gaps),
    ):
        for gap in sorted(gaps, key=lambda found: -found.metres)[:_WORST]:
            yield what, gap.x, gap.y, f"{gap.metres:.1f} m of lane {gap.lane}"
    for relation in fidelity.missing[:_WORST]:
        yield (
            "relation missing",
            relation.x,
            relation.y,
            f"lane {relation.source} to {relation.target}",
        )
    for relation in fidelity.invented[:_WORST]:
        text = f"lane {relation.source} to {relation.target}, SUMO lanes {relation.sumo}"
        yield "relation invented", relation.x, relation.y, text
    for lost in sorted(fidelity.lost_crosswalks, key=lambda found: found.share)[:_WORST]:
        text = f"road {lost.road}, object {lost.object_id}, {100 * lost.share:.0f} % overlapped"
        yield "crosswalk lost", lost.x, lost.y, text
    for pair in fidelity.unsafe_pairs[:_WORST]:
        links = f"links {pair.links[0]} and {pair.links[1]}"
        yield "unsafe green", pair.x, pair.y, f"light {pair.tl}, phase {pair.phase}, {links}"


def _format_figure(value: float) -> str:
    return f"{value:,}" if isinstance(value, int) else f"{value:.4f}"


def _map_row(entry: MapEntry) -> dict[str, Any]:
    keys = ("name", "sha256", "opendrive", "statistics", "graph", "build_seconds")
    network = entry.info.get("network", {"converter": entry.converter})  # maps of 0.1 have none
    fidelity = entry.info.get("fidelity")  # nor this
    row = {**{key: entry.info[key] for key in keys}, "network": network}
    return row if fidelity is None else {**row, "fidelity": fidelity}


def _warn_of_network(name: str, missed: list[dict[str, Any]]) -> str:
    limits = "; ".join(
        f"{verdict['name']} {verdict['value']:g}, limit {verdict['limit']:g}" for verdict in missed
    )
    return (
        f"{name}: warning: its SUMO network does not follow the map within the limits ({limits}); "
        f"odscen maps verify {name} says where"
    )


def _describe_added(entry: MapEntry) -> str:
    from odscen.maps.traffic_losses import traffic_losses

    graph = entry.info["graph"]
    losses = traffic_losses(entry.info.get("report", {}))
    return (
        f"{entry.name}: {graph['nodes']:,} nodes, {graph['segments']:,} segments, "
        f"built in {entry.info['build_seconds']:.1f} s{losses}"
    )


def _plain_value(value: object) -> object:
    return value if isinstance(value, int | float | str | None) else json.dumps(value)


@app.command()
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
    from odscen.maps.store import Workspace

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
                with scratch_folder() as folder, progress(name) as step:
                    file = folder / f"{name}.xodr"
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
