"""Recorded traffic: tracks of road users in the schemas of datasets, OSI traces, CommonRoad.

What is read is in :mod:`odscen.formats.tracks`; this is the entry in the list of formats.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from odscen.base.errors import InputError
from odscen.formats.base import ElementReport, FileContent, Format, FormatOption

if TYPE_CHECKING:
    from collections.abc import Sequence

    from odscen.formats.base import GivenFile, ImportSource

FOLLOWS = ("track", "react", "drive")
"""What a road user of a recording does: follows its track; until the ego is close; never."""


def read_tracks(source: ImportSource) -> FileContent:
    """Tracks of all road users of a file; with a map, a scenario in which they drive again.

    Raises
    ------
    InputError
        If it is no recorded traffic, or damaged; names the element and the value. With a map, if
        nobody of it is near a lane.
    """
    from odscen.formats.tracks.read_recording import read_recording

    recorded = read_recording(source.file, source.options)
    report = ElementReport(source.file.name)
    summary = recorded.summary()
    report.add("taken", f"{summary['road_users']} road users", f"schema {recorded.schema}")
    for column in recorded.unused:
        report.add("ignored", f"column {column}", "tracks do not need it")
    for note in recorded.notes:
        report.add("approximated", "rows", note)
    others = recorded.rows.filter(recorded.rows["category"].is_null())
    for kind, count in others.group_by("kind").agg(others["id"].n_unique()).sort("kind").rows():
        report.add("ignored", f"{count} of kind {kind}", "no category of road users is that")
    if not source.map_given:
        for name in ("ego", "follow"):
            if source.options.get(name):
                raise InputError(f"{name} is of a scenario, which needs a map: give it with --map")
        return FileContent(tracks=recorded.rows, lists=report.lists)
    from odscen.formats.tracks.scenario_of_tracks import SceneChoice, scenario_of_tracks

    follow = source.options.get("follow", "track")
    if follow not in FOLLOWS:
        raise InputError(f"follow is one of {', '.join(FOLLOWS)}, not {follow!r}")
    scenario = scenario_of_tracks(
        recorded,
        source.map(),
        SceneChoice(source.options.get("ego", ""), follow),
        name=source.name,
        assets=source.assets,
        report=report,
    )
    return FileContent(scenario=scenario, lists=report.lists)


def _choose_tracks(files: Sequence[GivenFile]) -> int:
    from odscen.formats.tracks.read_recording import choose_recording

    return choose_recording(files)


FORMAT = Format(
    id="trajectories",
    title="Recorded traffic (CSV, Parquet, OSI)",
    label="tracks of INTERACTION, SinD, levelX, NGSIM, Argoverse 2, ScenarioNet, CommonRoad, OSI "
    "and omega-prime, or a table of time, x, y and more",
    of=("scenario", "run"),
    suffixes=(".csv", ".parquet", ".osi", ".mcap", ".pkl"),
    read=read_tracks,
    choose_main=_choose_tracks,
    options=(
        FormatOption("window", "Part of the recording, FROM..TO in s or H:MM:SS."),
        FormatOption("offset", "Metres east and north, and degrees, to the map's frame: X,Y,D."),
        FormatOption("ego", "With a map: who is free for SUMO, CARLA or another driver."),
        FormatOption("follow", "With a map: what the others do.", FOLLOWS, "track"),
        FormatOption("columns", "Columns of another table: time=ms*0.001,id=vehicle,x=east,y=n."),
        FormatOption("case", "Which recording of a file of INTERACTION."),
        FormatOption("location", "Which recording of a file of NGSIM."),
    ),
)
