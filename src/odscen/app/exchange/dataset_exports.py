"""What a dataset takes of a run: its files without what all runs on a map share, and numbers."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import TYPE_CHECKING, Final

from odscen.app.exchange.exports import contents_of, kept_of, read_roads, run_contents, run_source
from odscen.app.maps import load_map

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from odscen.formats.pyg_format import SharedMap
    from odscen.maps.store import Workspace

ARRAYS: Final = "arrays"
"""What a study calls arrays of a run whose map lies elsewhere."""
STATISTICS: Final = "statistics"
STATISTICS_FILE: Final = "statistics.json"


def dataset_contents(
    workspace: Workspace, run: Path, formats: Sequence[str]
) -> dict[str, dict[str, bytes]]:
    """Files of a run by format and name, and its statistics.

    Parameters
    ----------
    formats
        Of ``odscen export``, or :data:`ARRAYS`.

    Raises
    ------
    InputError
        As of :func:`~odscen.app.exchange.exports.export_run`.
    """
    from odscen.formats.pyg_format import write_light_run_arrays
    from odscen.formats.recordings.record import recording_of
    from odscen.formats.recordings.track_statistics import track_statistics

    source = run_source(workspace, run)
    found = run_contents(source, {form: {} for form in formats if form != ARRAYS})
    contents = {form: contents_of(files) for form, files in found.items()}
    with_roads = replace(source, roads=read_roads(source.of_map, source.map_file))
    if ARRAYS in formats:
        contents[ARRAYS] = contents_of(write_light_run_arrays(with_roads))
    numbers = track_statistics(recording_of(with_roads))
    contents[STATISTICS] = {STATISTICS_FILE: json.dumps(numbers).encode()}
    return contents


def dataset_map(workspace: Workspace, name: str, sha256: str) -> SharedMap:
    """The file with the arrays of a map, as runs in :data:`ARRAYS` name it.

    Raises
    ------
    NotFoundError
        If the workspace has no map of that name and none of that content.
    InputError
        If the map of that name has other content.
    """
    from odscen.formats.pyg_format import shared_map

    loaded = load_map(workspace.map_for(name, sha256))
    of_map = kept_of(loaded.entry)
    roads = read_roads(of_map, loaded.entry.checked("xodr"))
    return shared_map(name, of_map, loaded.sumo, roads)
