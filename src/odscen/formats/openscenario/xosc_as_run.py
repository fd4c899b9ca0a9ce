"""What happened in a run as a storyboard: road users along lines, lights by state."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from odscen.base.categories import DEFAULT_BODY, Body, Category
from odscen.base.errors import InputError
from odscen.convert.lane_table.light_heads import SignalHeads
from odscen.formats.openscenario.dialect import xml
from odscen.formats.openscenario.xosc_entities import EntityFacts, entity_of
from odscen.formats.openscenario.xosc_lines import follow_line
from odscen.formats.openscenario.xosc_places import GroundPose, reference_behind
from odscen.formats.openscenario.xosc_presence import add_entity, delete_entity, private
from odscen.formats.openscenario.xosc_signals import light_action
from odscen.formats.openscenario.xosc_storyboard import act, event, maneuver_group
from odscen.formats.openscenario.xosc_triggers import name_of_end

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    import polars as pl
    from lxml.etree import _Element

    from odscen.formats.base import ExportSource, RecordedRun
    from odscen.formats.openscenario.dialect import Dialect
    from odscen.formats.openscenario.xosc_triggers import Triggers
    from odscen.records.run_plan import PlannedActor

MOST_POINTS: Final = 200_000
"""Points of all lines together."""
_Lines = dict[str, tuple[list[float], list[GroundPose]]]


@dataclass(frozen=True, slots=True)
class AsRun:
    """Makes the storyboard of what happened.

    Attributes
    ----------
    lines
        Times (s) and reference points of each road user who was there.
    """

    source: ExportSource
    recorded: RecordedRun
    dialect: Dialect
    triggers: Triggers
    environment: _Element | None
    lines: _Lines

    def entities(self) -> Iterator[_Element]:
        """``ScenarioObject`` of each road user who was there."""
        for user in self.recorded.users:
            if user.id in self.lines:
                yield entity_of(self._entity_facts(user), self.dialect)

    def storyboard(self) -> _Element:
        """``Storyboard``."""
        groups = [self._write_moves(name) for name in self.lines]
        states = self._signal_states()
        if states and self.dialect.for_scenario_runner:
            words = "ScenarioRunner refuses them by the id of a signal"
            self.triggers.notes.left_out.append(("traffic lights", words))
        elif changes := list(self._write_signal_changes(states)):
            groups.append(maneuver_group("traffic lights", None, changes))
        until, sky = self.recorded.until, self.environment
        whole = act("as run", groups, self.triggers, until=until, sky=sky)
        name = self.source.scenario.name
        end = self.triggers.at_time(until, name_of_end("never"))
        return xml(
            "Storyboard",
            xml("Init", xml("Actions", *self._write_init(states))),
            xml("Story", xml("ParameterDeclarations"), whole, name=name),
            xml("StopTrigger", end),
        )

    def _entity_facts(self, user: PlannedActor) -> EntityFacts:
        category = Category(user.category)
        known = None if user.model is None else self.source.assets.dimensions(user.model)
        height = (known or DEFAULT_BODY[category]).height
        kind = "ego_vehicle" if user.ego else "simulation"
        return EntityFacts(
            id=user.id,
            category=category,
            model=user.model,
            speed=user.speed,
            body=Body(user.length, user.width, height),
            properties={"type": kind},
        )

    def _write_init(self, states: Sequence[tuple[float, dict[str, str]]]) -> Iterator[_Element]:
        if self.environment is not None:
            yield xml("GlobalAction", xml("EnvironmentAction", self.environment))
        for time, shown in states[:1]:
            if time <= 0.0 and not self.dialect.for_scenario_runner:
                yield from _write_lights(shown)
        for name, (times, spots) in self.lines.items():
            there = times[0] <= 0.0
            if there or self.dialect.for_scenario_runner:
                spot = spots[0] if there else spots[0].below()
                teleport = private(xml("TeleportAction", spot.element()))
                yield xml("Private", teleport, entityRef=name)

    def _write_moves(self, name: str) -> _Element:
        times, spots = self.lines[name]
        line = follow_line(self.dialect, f"{name} as run", spots, times, clock="absolute")
        actions = [line] if times[0] <= 0.0 else [add_entity(name, spots[0], self.dialect), line]
        events = [self._write_event(f"{name} moves", actions, times[0])]
        gone = times[-1] + self.recorded.step
        if gone < self.recorded.until:
            leaves = delete_entity(name, spots[-1], self.dialect)
            events.append(self._write_event(f"{name} is gone", [leaves], gone))
        return maneuver_group(name, name, events)

    def _write_event(self, name: str, actions: Sequence[_Element], time: float) -> _Element:
        return event(name, actions, xml("StartTrigger", self.triggers.at_time(time, name)), 1)

    def _signal_states(self) -> list[tuple[float, dict[str, str]]]:
        """At each time the signals that change, with what they show from then on."""
        table = self.recorded.states
        if table is None:
            return []
        heads, letters = SignalHeads(self.source.sumo_map.lights), dict[str, str]()
        before: dict[str, str] = {}
        found = []
        for (time,), rows in table.sort("time", "light").group_by("time", maintain_order=True):
            letters |= dict(zip(rows["light"], rows["state"], strict=True))
            shown = heads.states({letter: letters[letter] for letter in letters})
            changed = {
                signal: state for signal, state in sorted(shown.items())
                if before.get(signal) != state
            }  # fmt: skip
            before = shown
            if changed:
                found.append((float(str(time)), changed))
        return found

    def _write_signal_changes(
        self, states: Sequence[tuple[float, dict[str, str]]]
    ) -> Iterator[_Element]:
        for time, shown in states:
            if time > 0.0:
                yield self._write_event(f"lights at {time:g} s", list(_write_lights(shown)), time)


def _write_lights(shown: dict[str, str]) -> Iterator[_Element]:
    for signal, state in shown.items():
        yield light_action(signal, state)


def lines_of(recorded: RecordedRun) -> _Lines:
    """Lines of reference points by road user; of each standstill the first and the last record.

    Raises
    ------
    InputError
        If nobody was there, or there are too many points for one file.
    """
    import polars as pl

    pose = pl.struct("x", "y", "hdg")
    kept = recorded.rows.filter(
        ((pose != pose.shift(1).over("id")) | (pose != pose.shift(-1).over("id"))).fill_null(
            value=True
        )
    )
    if not 0 < len(kept) <= MOST_POINTS:
        raise InputError(
            f"{len(kept)} places of road users were recorded; a file has 1 to {MOST_POINTS}"
        )
    rows = {str(name): part for (name,), part in kept.group_by("id", maintain_order=True)}
    return {
        user.id: _line_of_user(user, rows[user.id], recorded.step)
        for user in recorded.users
        if user.id in rows
    }


def _line_of_user(
    user: PlannedActor, rows: pl.DataFrame, step: float
) -> tuple[list[float], list[GroundPose]]:
    back = reference_behind(user.category, user.length)
    heights = rows["z"].fill_null(user.z) if "z" in rows.columns else [user.z] * len(rows)
    spots = [
        GroundPose(x, y, float(z), hdg).back(back)
        for x, y, z, hdg in zip(rows["x"], rows["y"], heights, rows["hdg"], strict=True)
    ]
    times = rows["time"].to_list()
    if len(spots) == 1:  # a line has two points at least
        return [times[0], times[0] + step], [*spots, *spots]
    return times, spots
