"""Event logs of signal controllers, played back as the program of a traffic light."""

from __future__ import annotations

import re
from datetime import datetime, time, timedelta
from itertools import pairwise
from typing import TYPE_CHECKING, Final, NamedTuple

from lxml import etree

from odscen.app.maps import map_of
from odscen.app.scenarios import given_scenario
from odscen.app.signals.signal_plans import with_raw_programs
from odscen.base.errors import InputError, NotFoundError, in_file
from odscen.base.given_files import as_path, read_given
from odscen.base.shown import shown, some_of
from odscen.figures.measures.controller_measures import (
    arrivals,
    arrivals_on_green,
    pedestrian_delays,
    split_failures,
)
from odscen.formats.controller_log import read_controller_log, read_log_detectors
from odscen.scenario.edits.edit_registry import changed_part, with_fields
from odscen.scenario.signals.light import find_movements, known_names

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    import polars as pl

    from odscen.base.given_files import GivenPath
    from odscen.maps.store import Workspace
    from odscen.scenario.document.scenario_document import Scenario
    from odscen.scenario.signals.light import Light

_SHOWN_BY: Final[Mapping[str, Mapping[int, str]]] = {
    "": {1: "G", 8: "y", 9: "r", 10: "r"},
    "P": {21: "G", 22: "r", 23: "r"},
    "O": {61: "G", 62: "G", 63: "y", 64: "r", 65: "r"},
}
"""What a phase, a pedestrian phase and an overlap show from an event on."""
_SHOWN_BEFORE: Final = {7: "G", 8: "G", 9: "y", 10: "y", 22: "G", 63: "G", 64: "y"}
"""What they have shown before the first event of the log, if it is this one."""
_CHANNEL: Final = re.compile(r"([PO]?)(\d{1,3})")
SILENCE: Final = 300.0
"""Seconds without any event of a controller that are told."""


class _Change(NamedTuple):
    seconds: float
    letter: str


def play_controller_log(
    workspace: Workspace,
    scenario: Scenario | GivenPath,
    file: GivenPath,
    *,
    junction: str,
    phases: Mapping[str, Sequence[str]],
    device: str | None = None,
    begin: str | None = None,
) -> tuple[Scenario, tuple[str, ...]]:
    """Let a light show what a controller has logged: raw phases, in steps of the simulation.

    Parameters
    ----------
    workspace
        Has the map.
    scenario
        The scenario, or its file; it is not changed.
    file
        The log: CSV or Parquet with time, device, event and parameter.
    junction
        The light, by its OpenDRIVE junction or SUMO's id.
    phases
        Movements of the light (:mod:`odscen.scenario.signals.light`) by the phase of the controller
        that shows them green: ``2``, ``P2`` for its walk, ``O1`` for an overlap.
    device
        Which controller of the log; not needed if there is only one.
    begin
        Time of the log at which the simulation begins, ``12:30`` or ``2024-04-15 12:30:00``; by
        default the scenario's time of day if it has one, else the first event.

    Returns
    -------
    tuple of Scenario and tuple of str
        The scenario, and in words what one should know of it.

    Raises
    ------
    InputError
        If the log cannot be read, has no event of a phase, or a movement is in no phase.
    NotFoundError
        If the light is not on the map, or the device not in the log.
    """
    scenario = given_scenario(scenario)
    path = as_path(file)
    with in_file(str(path)):
        events = _events_of_device(read_controller_log(read_given(path)), device)
    loaded = map_of(workspace, scenario)
    lights = list(zip(loaded.sumo.lights, loaded.lights, strict=True))
    chosen = [(own, view) for own, view in lights if junction in (own.id, *view.names)]
    if not chosen:
        names = [name for _, view in lights for name in view.names]
        raise NotFoundError("traffic light in junction", junction, names)
    light, view = chosen[0]
    links, notes = _links_of_phases(view, phases)
    start = _start_of(events, begin, clock=scenario.demand.clock)
    with in_file(str(path)):
        changes = {
            channel: _changes_of_channel(events, channel, start, scenario.simulation.step_length)
            for channel in links
        }
        last = (events["time"][-1] - start).total_seconds()
        if last <= 0:
            raise InputError(f"the log ends before {start:%Y-%m-%d %H:%M:%S}")
    notes += _find_silences(events)
    if last < scenario.simulation.duration:
        notes.append(
            f"the log ends {last:.0f} s after the run begins, which lasts "
            f"{scenario.simulation.duration:g} s: then it begins anew"
        )
    rows, meeting = _phases_of_light(view, links, changes)
    if meeting:
        notes.append(f"green together in the log, though they cross: {some_of(sorted(meeting))}")
    content = _program_xml(light.id, rows, last)
    scenario = with_raw_programs(scenario, content, [light.id], {light.id})
    kept = [timing for timing in scenario.signals.junctions if timing.junction not in view.names]
    signals = changed_part(scenario.signals, {"junctions": tuple(kept)})
    return with_fields(scenario, signals=signals), tuple(notes)


def controller_measures(
    file: GivenPath, detectors: GivenPath, *, minutes: int = 15
) -> dict[str, pl.DataFrame]:
    """Compute the measures of practice of an event log.

    Parameters
    ----------
    file
        The log: CSV or Parquet with time, device, event and parameter.
    detectors
        Table of its detectors: device, phase, parameter and function.
    minutes
        Length of the bins.

    Returns
    -------
    dict of str to polars.DataFrame
        ``arrivals_on_green``, ``split_failures`` and ``pedestrian_delays`` by device, phase and
        bin, and ``arrivals``, the points of a Purdue coordination diagram; columns are told in
        :mod:`odscen.figures.measures.controller_measures`.

    Raises
    ------
    InputError
        If one of the files cannot be read; names file, row and value.
    """
    log, table = as_path(file), as_path(detectors)
    with in_file(str(log)):
        events = read_controller_log(read_given(log))
    with in_file(str(table)):
        found = read_log_detectors(read_given(table))
        if events.join(found, on=["device", "parameter"], how="semi").is_empty():
            raise InputError(
                f"none of its detectors is in the log, whose devices are "
                f"{some_of(events['device'].unique(maintain_order=True).to_list())}"
            )
    return {
        "arrivals_on_green": arrivals_on_green(events, found, minutes=minutes),
        "split_failures": split_failures(events, found, minutes=minutes),
        "pedestrian_delays": pedestrian_delays(events, minutes=minutes),
        "arrivals": arrivals(events, found),
    }


def _events_of_device(events: pl.DataFrame, device: str | None) -> pl.DataFrame:
    import polars as pl

    known = events["device"].unique(maintain_order=True).to_list()
    if device is None:
        if len(known) > 1:
            raise InputError(f"the log has {len(known)} devices, name one: {some_of(known)}")
        return events
    if device not in known:
        raise NotFoundError("device", device, known)
    return events.filter(pl.col("device") == device)


def _links_of_phases(
    view: Light, phases: Mapping[str, Sequence[str]]
) -> tuple[dict[str, tuple[int, ...]], list[str]]:
    """Places in the light's states by phase of the controller, and what is in none."""
    links: dict[str, tuple[int, ...]] = {}
    for channel, names in phases.items():
        if _CHANNEL.fullmatch(channel) is None:
            raise InputError(f"{shown(channel)} is no phase such as 2, P2 (walk) or O1 (overlap)")
        found: list[int] = []
        for name in names:
            own = find_movements(name, view.movements)
            if not own:
                raise InputError(
                    f"phase {channel}: the light has no movement {shown(name)}, but "
                    f"{some_of(known_names(view.movements))}"
                )
            found += own
        links[channel] = tuple(found)
    taken = {link for own in links.values() for link in own}
    left = [movement for n, movement in enumerate(view.movements) if n not in taken]
    driven = sorted({movement.name for movement in left if movement.drive})
    if driven:
        raise InputError(f"no phase shows green to {some_of(driven)}: name one for each movement")
    walks = sorted({movement.name for movement in left if movement.walk})
    return links, [f"no phase is named for {some_of(walks)}: red all the time"] if walks else []


def _start_of(events: pl.DataFrame, begin: str | None, *, clock: float) -> datetime:
    """When the simulation begins in the time of the log."""
    first: datetime = events["time"][0]
    if begin is None:
        if not clock:
            return first.replace(microsecond=0)
        begin = f"{timedelta(seconds=round(clock))}"
    try:
        at = (
            datetime.combine(
                first.date(), time.fromisoformat(begin.zfill(5 if len(begin) < 6 else 8))
            )
            if re.fullmatch(r"\d{1,2}(:\d\d){1,2}", begin)
            else datetime.fromisoformat(begin)
        ).replace(tzinfo=None)
    except ValueError as error:
        raise InputError(
            f"{shown(begin)} is no time such as 12:30 or 2024-04-15 12:30:00"
        ) from error
    end: datetime = events["time"][-1]
    if not first - timedelta(seconds=SILENCE) <= at < end:
        raise InputError(
            f"the log is of {first:%Y-%m-%d %H:%M:%S} to {end:%Y-%m-%d %H:%M:%S}, the run would "
            f"begin at {at:%Y-%m-%d %H:%M:%S}: say with begin when it is to begin in the log"
        )
    return at


def _changes_of_channel(
    events: pl.DataFrame, channel: str, start: datetime, step: float
) -> list[_Change]:
    """What a phase shows from when on, in whole steps of the simulation; the first from 0 s on."""
    import polars as pl

    match = _CHANNEL.fullmatch(channel)
    kind, number = ("", "0") if match is None else match.groups()
    letters = _SHOWN_BY[kind]
    own = events.filter(
        pl.col("parameter") == int(number),
        pl.col("event").is_in([*letters, *([7] if not kind else [])]),
    )
    if not own["event"].is_in([code for code, letter in letters.items() if letter == "G"]).any():
        raise InputError(f"the log has no green of phase {channel}")
    state = _SHOWN_BEFORE.get(int(own["event"][0]), "r")
    changes = [_Change(0.0, state)]
    for stamp, code in zip(own["time"], own["event"], strict=True):
        letter = letters.get(code)
        if letter is None:
            continue
        steps = max(round((stamp - start).total_seconds() / step), 0)
        changes.append(_Change(steps * step, letter))
    return changes


def _find_silences(events: pl.DataFrame) -> list[str]:
    return [
        f"no event from {before:%H:%M:%S} to {after:%H:%M:%S}: the light stays as it was"
        for before, after in pairwise(events["time"].unique(maintain_order=True))
        if (after - before).total_seconds() > SILENCE
    ]


def _phases_of_light(
    view: Light,
    links: Mapping[str, Sequence[int]],
    changes: Mapping[str, Sequence[_Change]],
) -> tuple[list[tuple[float, str]], set[str]]:
    """States with the seconds at which they begin, and movements that cross in their green."""
    order = sorted(
        (change.seconds, row, channel, change.letter)
        for channel, own in changes.items()
        for row, change in enumerate(own)
    )
    shows = dict.fromkeys(links, "r")
    rows: list[tuple[float, str]] = []
    meeting: set[str] = set()
    for number, (seconds, _, channel, letter) in enumerate(order):
        shows[channel] = letter
        if number + 1 < len(order) and order[number + 1][0] == seconds:
            continue
        state = ["r"] * len(view.movements)
        for rank in "yG":  # of several phases of a movement the green one counts
            for own, shown_now in shows.items():
                if shown_now == rank:
                    for link in links[own]:
                        state[link] = rank
        for met in view.meetings:
            if state[met.one] in "Gg" and state[met.other] in "Gg":
                if met.yields >= 0:
                    state[met.yields] = "g"
                if not met.shares:
                    names = sorted(view.movements[n].name for n in (met.one, met.other))
                    meeting.add(" with ".join(names))
        if not rows or rows[-1][1] != "".join(state):
            rows.append((seconds, "".join(state)))
    return rows, meeting


def _program_xml(light: str, rows: Sequence[tuple[float, str]], last: float) -> bytes:
    root = etree.Element("additional")
    logic = etree.SubElement(root, "tlLogic", id=light, type="static", programID="log", offset="0")
    ends = [seconds for seconds, _ in rows[1:]] + [max(last, rows[-1][0] + 1.0)]
    for (seconds, state), end in zip(rows, ends, strict=True):
        etree.SubElement(logic, "phase", duration=f"{end - seconds:.3f}", state=state)
    return etree.tostring(root)
