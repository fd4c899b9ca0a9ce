"""What a child process does with OpenSCENARIO files that were sent."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

from odscen.app.exchange.xosc_files import GivenXosc, SentFiles, read_tree
from odscen.app.scenario_imports import plan_text, read_files, wanted_map
from odscen.base.errors import InputError
from odscen.maps.store import Workspace
from odscen.scenario.document.json_form import dumps

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

SCENARIO, REPORT, PLAN = "scenario.json", "report.json", "plan.json"
"""Files that :func:`read_sent` writes; the last one if there is a plan."""


def look_at_sent(
    *, files: Sequence[Mapping[str, str]], progress: Callable[[str, float], None]
) -> dict[str, Any]:
    """Which of the files is the scenario, and the map that it names; a job of a child."""
    progress("reading the file", 0.0)
    given = _given(files)
    main = _main(given)
    return {"main": main, "map": wanted_map(SentFiles(main, given))}


def read_sent(
    *,
    files: Sequence[Mapping[str, str]],
    main: int,
    workspace: str,
    map_name: str,
    name: str,
    ego: Any,
    folder: str,
    progress: Callable[[str, float], None],
) -> dict[str, Any]:
    """Read the scenario, and write it and its report into a folder; a job of a child."""
    progress("reading the scenario", 0.0)
    sent = SentFiles(main, _given(files), map_name)
    store = Workspace.open(Path(workspace))
    scenario, lists, plan = read_files(store, sent, name=name, ego=ego)
    rows = {verdict: [row._asdict() for row in found] for verdict, found in lists.items()}
    out = Path(folder)
    (out / SCENARIO).write_text(dumps(scenario), encoding="utf-8")
    (out / REPORT).write_text(json.dumps(rows), encoding="utf-8")
    if plan is not None:
        (out / PLAN).write_text(plan_text(plan), encoding="utf-8")
    return {}


def _given(files: Sequence[Mapping[str, str]]) -> tuple[GivenXosc, ...]:
    return tuple(GivenXosc(one["name"], Path(one["path"])) for one in files)


def _main(given: tuple[GivenXosc, ...]) -> int:
    """The one file that is a distribution, else the one with a storyboard."""
    roots = [read_tree(one.path, name=one.name) for one in given]
    for tag in ("ParameterValueDistribution", "Storyboard"):
        found = [row for row, root in enumerate(roots) if root.find(tag) is not None]
        if len(found) == 1:
            return found[0]
        if found:
            names = ", ".join(given[row].name for row in found)
            raise InputError(
                f"these are {len(found)} scenarios ({names}): send one at a time, with its map"
            )
    raise InputError(
        "there is no scenario among the files: none has a Storyboard",
        file=", ".join(one.name for one in given),
    )
