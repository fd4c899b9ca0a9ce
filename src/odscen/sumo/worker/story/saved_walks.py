"""Walks in a saved state that SUMO could not load again: of persons that were sent elsewhere.

A person whose walk was removed and replaced stands in the state with the whole of its old walk,
whose end is not where the new one begins ("Disconnected plan"), and the new walk without the place
where it ends.
"""

from __future__ import annotations

import gzip
import re
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from pathlib import Path

_PERSON = re.compile(r'\s*<person id="([^"]*)"')
_END = "</person>"
_WALK = re.compile(r"(\s*)<walk ")
_VALUES = re.compile(r' (\w+)="([^"]*)"')
_REMOVED = re.compile(r'<stop lane="([^"]*)".*actType="last stage removed"')
_UNDER_WAY = "-1"
"""``ended`` of a stage that has not."""


def mend_walks(state: Path, arrivals: Mapping[str, float], edge_of: Callable[[str], str]) -> None:
    """Write a saved state anew so that it can be loaded.

    Parameters
    ----------
    state
        File, gzipped XML as SUMO writes it: one element a line.
    arrivals
        Metres along the last edge at which the new walk of each such person ends.
    edge_of
        Edge of a lane.
    """
    with gzip.open(state, "rt", encoding="utf-8") as file:
        lines = file.read().splitlines(keepends=True)
    name: str | None = None
    for number, line in enumerate(lines):
        begins = _PERSON.match(line)
        if begins is not None:
            name = begins[1]
        elif _END in line:
            name = None
        elif name is not None and name in arrivals:
            following = _REMOVED.search(lines[number + 1])
            lines[number] = _mend_walk(line, arrivals[name], following and edge_of(following[1]))
    raw = "".join(lines).encode()
    state.write_bytes(gzip.compress(raw, compresslevel=6, mtime=0))


def _mend_walk(line: str, arrival: float, stopped: str | None) -> str:
    walk = _WALK.match(line)
    if walk is None:
        return line
    values = dict(_VALUES.findall(line))
    if values.get("ended") != _UNDER_WAY:
        if stopped is None:
            return line
        times = " ".join(f'{key}="{values[key]}"' for key in ("started", "ended"))
        edges = values["edges"].split()
        return f'{walk[1]}<tranship from="{edges[0]}" to="{stopped}" {times}/>\n'
    if "arrivalPos" in values:
        return line
    return line.replace("<walk ", f'<walk arrivalPos="{arrival:.6f}" ', 1)
