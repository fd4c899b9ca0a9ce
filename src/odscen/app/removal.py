"""Maps, scenarios and runs are removed: what depends on them first, then into the wastebasket."""

from __future__ import annotations

import json
import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

from odscen.base.errors import ConflictError, NotFoundError
from odscen.maps.folder_names import check_name
from odscen.maps.map_entry import MapEntry
from odscen.maps.wastebasket import SCENARIO_SUFFIX, Wastebasket
from odscen.runs import layout
from odscen.runs.run_status import going
from odscen.sumo.runner.long_runs import about

if TYPE_CHECKING:
    from collections.abc import Iterable
    from pathlib import Path

    from odscen.maps.store import Workspace
    from odscen.maps.wastebasket import RemovedItem, RemovedKind


_EARLY = 1 << 16
"""Characters of a scenario in which its map is looked for before all of it is read."""
_DECODER = json.JSONDecoder()
_FIRST, _COLON, _COMMA = (re.compile(rf"\s*{sign}\s*") for sign in "{:,")


class KnownRun(NamedTuple):
    """What is known of a run; ``live`` while processes work on it."""

    name: str
    map: object
    map_sha256: object
    live: bool


@dataclass(frozen=True, slots=True)
class RemovalFacts:
    """What stays behind, and needs what is removed.

    Attributes
    ----------
    kind, name
        Of what is to be removed.
    scenarios
        Scenarios on the map.
    runs
        Runs on the map, or of the scenario.
    live
        How many of these go on now; for a run 1 if it does, and it cannot be removed.
    """

    kind: RemovedKind
    name: str
    scenarios: int
    runs: int
    live: int


def known_runs(workspace: Workspace) -> list[KnownRun]:
    """Runs in the workspace's folder, those that go on in slices included."""
    folders = sorted(workspace.runs.iterdir()) if workspace.runs.is_dir() else ()
    return [known for folder in folders if (known := _read_known_run(folder)) is not None]


def removal_facts(
    workspace: Workspace, kind: RemovedKind, name: str, *, runs: Iterable[KnownRun] | None = None
) -> RemovalFacts:
    """What depends on a map, a scenario or a run.

    Parameters
    ----------
    runs
        All runs, where the caller knows of more than there are folders.

    Raises
    ------
    NotFoundError
        If there is no such thing.
    """
    check_name(name, what=kind)
    runs = known_runs(workspace) if runs is None else list(runs)
    if kind == "run":
        if not (workspace.runs / name).is_dir() and all(run.name != name for run in runs):
            raise NotFoundError(kind, name, [run.name for run in runs])
        live = any(run.live for run in runs if run.name == name)
        return RemovalFacts(kind, name, scenarios=0, runs=0, live=int(live))
    if kind == "scenario":
        files = _scenario_files(workspace)
        if name not in files:
            raise NotFoundError(kind, name, list(files))
        own = re.compile(rf"{re.escape(name[:56])}-[1-9]\d*|{re.escape(name)}")
        found = [run for run in runs if own.fullmatch(run.name)]
        return RemovalFacts(kind, name, 0, len(found), sum(run.live for run in found))
    names = workspace.map_names()
    if name not in names:
        raise NotFoundError(kind, name, names)
    keys = _texts_within(
        name, _read_json_object(workspace.root / "maps" / name / "map.json").get("sha256")
    )
    on_it = [group for group in map(_map_of, _scenario_files(workspace).values()) if keys & group]
    found = [run for run in runs if keys & _texts_within(run.map, run.map_sha256)]
    return RemovalFacts(kind, name, len(on_it), len(found), sum(run.live for run in found))


def remove(workspace: Workspace, kind: RemovedKind, name: str) -> RemovedItem:
    """Move a map, a scenario with its history, or a run into the wastebasket.

    Runs that go on keep what they need of a map, and the map that a run in slices was made on is
    found in the wastebasket when it is resumed, see :func:`removed_map`.

    Raises
    ------
    NotFoundError
        If there is no such thing.
    ConflictError
        If it is a run that goes on.
    WorkspaceError
        If it cannot be moved.
    """
    if kind == "run" and going(workspace.runs / check_name(name, what=kind)) == "running":
        raise ConflictError(f"run {name!r} is running in another process")
    return Wastebasket(workspace).put(kind, name)


def removed_map(workspace: Workspace, sha256: str) -> MapEntry | None:
    """Map of that content in the wastebasket; ``None`` if there is none that can be read."""
    for item in Wastebasket(workspace).items():
        if item.kind == "map":
            info = _read_json_object(item.content / "map.json")
            if info.get("sha256") == sha256:
                return MapEntry(item.name, item.content, info)
    return None


def _read_known_run(folder: Path) -> KnownRun | None:
    """What the folder of a run says of itself; ``None`` if it is none."""
    state = going(folder)
    if state is not None:
        summary = about(folder)
    elif (folder / layout.SUMMARY_FILE).is_file() and not folder.name.startswith("."):
        summary = _read_json_object(folder / layout.SUMMARY_FILE)
    else:
        return None
    return KnownRun(folder.name, summary.get("map"), summary.get("map_sha256"), state == "running")


def _scenario_files(workspace: Workspace) -> dict[str, Path]:
    files = sorted(workspace.scenarios.glob(f"*{SCENARIO_SUFFIX}"))
    return {path.name.removesuffix(SCENARIO_SUFFIX): path for path in files}


def _map_of(scenario: Path) -> set[str]:
    """Name and hash of the map that a scenario's file names."""
    found = _read_early_field(scenario, "map") or _read_json_object(scenario).get("map")
    return (
        _texts_within(found.get("name"), found.get("sha256")) if isinstance(found, dict) else set()
    )


def _skip_sign(sign: re.Pattern[str], text: str, place: int) -> int:
    """Where a sign that is at a place ends; ``ValueError`` if it is not there."""
    match = sign.match(text, place)
    if match is None:
        raise ValueError(sign.pattern)
    return match.end()


def _read_early_field(path: Path, key: str) -> object:
    """A field of an object that comes early in a large file; ``None`` if it does not."""
    try:
        with path.open(encoding="utf-8", errors="replace") as file:
            text = file.read(_EARLY)
        place = _skip_sign(_FIRST, text, 0)
        while True:
            name, place = _DECODER.raw_decode(text, place)
            value, place = _DECODER.raw_decode(text, _skip_sign(_COLON, text, place))
            if name == key:
                return value
            place = _skip_sign(_COMMA, text, place)
    except (OSError, ValueError, RecursionError):
        return None


def _texts_within(*values: object) -> set[str]:
    return {value for value in values if isinstance(value, str)}


def _read_json_object(path: Path) -> dict[str, Any]:
    """An object in a file; empty if there is none that can be read."""
    try:
        found = json.loads(path.read_bytes())
    except (OSError, ValueError, RecursionError):
        return {}
    return found if isinstance(found, dict) else {}
