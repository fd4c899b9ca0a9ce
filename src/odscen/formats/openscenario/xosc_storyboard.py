"""Rules as the storyboard: what is at first, an event for each item of a rule, and the end."""

from __future__ import annotations

from copy import deepcopy
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from odscen.formats.openscenario.dialect import xml
from odscen.formats.openscenario.xosc_actions import (
    IGNORES,
    UNSAID_GOAL,
    Actions,
    acquire,
)
from odscen.formats.openscenario.xosc_presence import (
    BELOW,
    add_entity,
    private,
    speed_action,
)
from odscen.formats.openscenario.xosc_triggers import (
    END,
    CannotSayError,
    Triggers,
    name_of_end,
)

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from lxml.etree import _Element

    from odscen.formats.base import ExportNotes
    from odscen.formats.openscenario.dialect import Dialect
    from odscen.formats.openscenario.xosc_places import Places
    from odscen.scenario.document.rules_document import Action, StoryRule
    from odscen.scenario.document.scenario_document import Actor, Scenario

_LONGEST: Final = 300.0
"""Seconds after which ScenarioRunner stops a scenario: the default in its class OpenScenario."""


@dataclass(frozen=True, slots=True)
class Story:
    """Makes the storyboard of a scenario."""

    scenario: Scenario
    places: Places
    dialect: Dialect
    notes: ExportNotes
    environment: _Element | None

    def storyboard(self) -> _Element:
        """``Storyboard``."""
        actors = {actor.id: actor for actor in self.scenario.actors}
        self._note_goals()
        groups = [
            group
            for actor in self.scenario.actors
            if (group := self._write_late_departure(actor)) is not None
        ]
        rules, events = self._write_rules(actors)
        groups, ends = groups + rules, self._write_run_ends(events)
        duration = self.scenario.simulation.duration
        triggers = Triggers(self.places, self.dialect, self.notes, {})
        end = name_of_end(self.scenario.simulation.after_story)
        return xml(
            "Storyboard",
            xml("Init", xml("Actions", *self._write_init(self.scenario.actors))),
            xml(
                "Story",
                xml("ParameterDeclarations"),
                act("rules", groups, triggers, until=duration, ends=ends, sky=self.environment),
                name=self.scenario.name,
            ),
            xml(
                "StopTrigger",
                triggers.at_time(duration, end),
                *ends,
            ),
        )

    def _write_init(self, actors: Sequence[Actor]) -> Iterable[_Element]:
        if self.environment is not None:
            yield xml("GlobalAction", xml("EnvironmentAction", self.environment))
        for actor in actors:
            start = self.places.start(actor)
            if actor.depart > 0 or self._appears_by_rule(actor.id):
                if self.dialect.for_scenario_runner:
                    below = private(xml("TeleportAction", start.below().element()))
                    yield xml("Private", below, entityRef=actor.id)
                    self.notes.approximated.append((f"actors[{actors.index(actor)}]", BELOW))
                continue
            actions = [
                private(xml("TeleportAction", start.element())),
                speed_action(actor.initial_speed or 0.0, "step", "time", 0.0),
            ]
            if actor.goal is not None and not self.dialect.for_scenario_runner:
                actions.append(acquire(self.places, actor.goal))
            yield xml("Private", *actions, entityRef=actor.id)

    def _appears_by_rule(self, actor: str) -> bool:
        return any(
            rule.actor == actor and part.kind == "appear"
            for rule in self.scenario.rules
            for item in rule.then
            for part in item.parts
        )

    def _note_goals(self) -> None:
        if self.dialect.for_scenario_runner:
            self.notes.left_out += [
                (f"actors[{index}].goal", UNSAID_GOAL)
                for index, actor in enumerate(self.scenario.actors)
                if actor.goal is not None
            ]

    def _write_late_departure(self, actor: Actor) -> _Element | None:
        """Maneuver group of an actor that departs later."""
        if actor.depart <= 0 or self._appears_by_rule(actor.id):
            return None
        triggers = Triggers(self.places, self.dialect, self.notes, {})
        actions = [
            add_entity(actor.id, self.places.start(actor), self.dialect),
            speed_action(actor.initial_speed or 0.0, "step", "time", 0.0),
        ]
        if actor.goal is not None and not self.dialect.for_scenario_runner:
            actions.append(acquire(self.places, actor.goal))
        trigger = xml("StartTrigger", triggers.at_time(actor.depart, f"{actor.id} departs"))
        name = f"{actor.id} departs"
        return maneuver_group(name, actor.id, [event(name, actions, trigger, 1)])

    def _write_rules(
        self, actors: dict[str, Actor]
    ) -> tuple[list[_Element], dict[str, tuple[str, str]]]:
        """Maneuver groups of rules, and the first and last event of each.

        Those that cannot be said are left out, and whom they free.
        """
        left = {rule.id: rule for rule in self.scenario.rules if _run_ending_item(rule) != 0}
        while True:
            events = {name: _first_and_last_event(rule) for name, rule in left.items()}
            found, refused = [], {}
            for index, rule in enumerate(self.scenario.rules):
                if rule.id not in left:
                    continue
                try:
                    found.append(self._write_rule(rule, f"rules[{index}]", events, actors))
                except CannotSayError as error:
                    refused[rule.id] = (f"rules[{index}]", str(error))
            if not refused:
                return found, events
            for name, words in refused.items():
                self.notes.left_out.append(words)
                del left[name]

    def _write_run_ends(self, events: dict[str, tuple[str, str]]) -> list[_Element]:
        """Groups of conditions on which rules end the run."""
        triggers = Triggers(self.places, self.dialect, self.notes, events)
        found: list[_Element] = []
        for index, rule in enumerate(self.scenario.rules):
            where, last = f"rules[{index}]", _run_ending_item(rule)
            if last is None or (last and rule.id not in events):
                continue
            try:
                if last:
                    found += triggers.after(events[rule.id][1])
                else:
                    found += triggers.trigger(rule.when, rule.actor, where)
            except CannotSayError as error:
                self.notes.left_out.append((where, str(error)))
                continue
            words = "the end of the run is a stop trigger, which has no name and no actor"
            self.notes.approximated.append((where, words))
        return found

    def _write_rule(
        self,
        rule: StoryRule,
        where: str,
        events: dict[str, tuple[str, str]],
        actors: dict[str, Actor],
    ) -> _Element:
        if rule.actor not in actors:
            raise CannotSayError(f"rule {rule.id!r} is of {rule.actor!r}, a vehicle of a flow")
        if rule.times > 1 and self.dialect.for_scenario_runner:
            self.notes.approximated.append((where, "ScenarioRunner lets it happen once"))
        triggers = Triggers(self.places, self.dialect, self.notes, events)
        makes = Actions(self.places, self.dialect, self.notes, actors, self.scenario.rules)
        made: list[_Element] = []
        lasting: float | None = None
        written_items = _items_written(rule)
        for index in {*range(len(rule.then))} - {*written_items}:
            self.notes.approximated.append((f"{where}.then", f"item {index}: {IGNORES}"))
        for index in written_items:
            item = rule.then[index]
            actions = [
                action
                for part in item.parts
                for action in makes.actions(
                    part.kind, getattr(part, part.kind), rule.actor, f"{where}.then[{index}]"
                )
            ]
            if not actions:
                raise CannotSayError("a rule that does nothing there")
            name = _event_name(rule, index)
            trigger = (
                triggers.trigger(rule.when, rule.actor, where)
                if index == written_items[0]
                else triggers.after(_event_name(rule, written_items[len(made) - 1]), lasting)
            )
            over = "override" if self.dialect.minor >= 2 else "overwrite"
            priority = "parallel" if lasting is None else over
            made.append(event(name, actions, trigger, rule.times, priority=priority))
            lasting = _lasting_gap(item)
            if lasting is not None and index == written_items[-1]:
                words = "the gap is kept until another action takes the speed"
                self.notes.approximated.append((f"{where}.then[{index}]", words))
        return maneuver_group(rule.id, rule.actor, made)


def act(
    name: str,
    groups: Sequence[_Element],
    triggers: Triggers,
    *,
    until: float,
    sky: _Element | None,
    ends: Sequence[_Element] = (),
) -> _Element:
    """``Act`` with all maneuver groups, from the start of the run on.

    ScenarioRunner does not ask when the storyboard stops: it ends when all acts are over, or after
    300 s. So there the act has a stop trigger, and an event at the end that sets the weather again.
    """
    start, stop = xml("StartTrigger", triggers.at_time(0.0, "begin")), None
    if triggers.dialect.for_scenario_runner:
        if until > _LONGEST:
            words = f"ScenarioRunner stops after {_LONGEST:g} s"
            triggers.notes.approximated.append(("simulation.duration", words))
        end = xml("StartTrigger", triggers.at_time(until, END))
        weather = xml("GlobalAction", xml("EnvironmentAction", deepcopy(sky)))
        last = event(f"weather at the {END}", [weather], end, 1)
        groups = [*groups, maneuver_group(END, None, [last])]
        early = deepcopy(list(ends))
        stop = xml("StopTrigger", triggers.at_time(until, f"{END}, of the act"), *early)
    if not groups:  # a story needs one
        nobody = xml("Actors", selectTriggeringEntities=False)
        groups = [xml("ManeuverGroup", nobody, name="none", maximumExecutionCount=1)]
    return xml("Act", *groups, start, stop, name=name)


def _lasting_gap(item: Action) -> float | None:
    """Seconds after which an item is over whose action has no end in the standard."""
    parts = [part.keep_gap for part in item.parts if part.keep_gap is not None]
    return next((part.lasting for part in parts if not part.once), None)


def event(
    name: str,
    actions: Sequence[_Element],
    trigger: _Element,
    times: int,
    *,
    priority: str = "parallel",
) -> _Element:
    """``Event`` with each action under a name of its own."""
    named = [
        xml("Action", action, name=f"{name}.{number}")
        for number, action in enumerate(actions, start=1)
    ]
    return xml(
        "Event",
        *named,
        trigger,
        name=name,
        priority=priority,
        maximumExecutionCount=times,
    )


def maneuver_group(name: str, actor: str | None, events: Sequence[_Element]) -> _Element:
    """``ManeuverGroup`` of one actor, or of none for what is global."""
    refs = [] if actor is None else [xml("EntityRef", entityRef=actor)]
    return xml(
        "ManeuverGroup",
        xml("Actors", *refs, selectTriggeringEntities=False),
        xml("Maneuver", *events, name=name),
        name=name,
        maximumExecutionCount=1,
    )


def _first_and_last_event(rule: StoryRule) -> tuple[str, str]:
    """Names of the first and the last event of a rule."""
    written_items = _items_written(rule)
    return _event_name(rule, written_items[0]), _event_name(rule, written_items[-1])


def _items_written(rule: StoryRule) -> list[int]:
    """Items of a rule that do something there; all of them if none does."""
    items = range(len(rule.then) if _run_ending_item(rule) is None else _run_ending_item(rule) or 0)
    found = [n for n in items if {part.kind for part in rule.then[n].parts} != {"ignore"}]
    return found or list(items)


def _run_ending_item(rule: StoryRule) -> int | None:
    """Item of a rule that ends the run: the stop trigger, and no event."""
    return next((n for n, item in enumerate(rule.then) if item.kind == "end"), None)


def _event_name(rule: StoryRule, index: int) -> str:
    return f"{rule.id}.then[{index}]"
