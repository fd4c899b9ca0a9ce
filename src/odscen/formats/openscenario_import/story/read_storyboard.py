"""The storyboard as rules: one for each event and actor."""

from __future__ import annotations

import itertools
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final

from odscen.base.errors import InputError, ScenarioError
from odscen.formats.openscenario_import.import_report import RefusedError
from odscen.formats.openscenario_import.source.own_files import said_in_properties
from odscen.formats.openscenario_import.story.global_actions import READ, tell_unread
from odscen.formats.openscenario_import.story.read_actions import FOLLOWING
from odscen.formats.openscenario_import.story.read_conditions import ALWAYS, joined
from odscen.formats.openscenario_import.story.read_motions import JUMP
from odscen.formats.openscenario_import.story.value_changes import new_value, sets_in_story
from odscen.formats.openscenario_import.world.read_entities import plain_id
from odscen.scenario.document.problems import validated
from odscen.scenario.document.rules_document import StoryRule

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from lxml.etree import _Element

    from odscen.formats.openscenario_import.import_report import ImportReport
    from odscen.formats.openscenario_import.places.read_positions import PositionReader
    from odscen.formats.openscenario_import.story.read_actions import ActionReader
    from odscen.formats.openscenario_import.world.read_entities import ReadEntity
    from odscen.scenario.document.scenario_document import Actor

Made = dict[str, Any]
_HOLDERS = frozenset({"Story", "Act", "ManeuverGroup", "Maneuver"})


def refuse_beyond_bounds(kind: type[Actor | StoryRule], made: Made, element: _Element) -> None:
    """Refuse an element of which an actor or a rule came that a scenario cannot have.

    Raises
    ------
    RefusedError
        With the field and its value.
    """
    try:
        validated(kind, made)
    except ScenarioError as error:
        raise RefusedError(element, error.problem) from error


class LaterError(RefusedError):
    """An element that waits for one that may still be read."""


@dataclass(slots=True)
class StoryReader:
    """Reads the stories of a storyboard; ``rules`` grow in the order of the file.

    Attributes
    ----------
    driven
        Ids of actors that something else drives: their events are ignored.
    later
        What actors do first that the story puts on the road, by their ids.
    own
        Whether odscen wrote the file: a maneuver group is one rule.
    """

    report: ImportReport
    entities: dict[str, ReadEntity]
    driven: frozenset[str] = frozenset()
    rules: list[Made] = field(default_factory=list)
    actions: ActionReader | None = None
    later: dict[str, list[Made]] = field(default_factory=dict)
    own: bool = False
    _ids: set[str] = field(default_factory=set)
    _made: dict[_Element, list[Made]] = field(default_factory=dict)
    _whens: dict[_Element, Made] = field(default_factory=dict)
    _asked: set[_Element] = field(default_factory=set)
    _waiting: list[tuple[_Element, _Element | None, list[str]]] = field(default_factory=list)
    _last: list[bool] = field(default_factory=list)
    _placed: set[str] = field(default_factory=set)

    def read(self, board: _Element) -> None:
        """Read all events; an event that cannot be taken over is left out."""
        for story in self.report.children(board, "Story"):
            for act in self.report.children(story, "Act"):
                self._read_act(act)
        while self._waiting:  # for elements that come later in the file
            again, self._waiting = self._waiting, []
            for later_event in again:
                self._read_event(*later_event)
            if len(self._waiting) == len(again):
                self._last.append(True)

    def changes(self, kind: _Element, name: str) -> list[tuple[str, Made]]:
        """Values that events set a parameter or variable to, and when they have.

        Raises
        ------
        RefusedError
            If the trigger of such an event has no counterpart, or waits for this.
        """
        found = []
        for action in sets_in_story(kind.getroottree().getroot(), name):
            event = next(action.iterancestors("Event"), None)
            if event is None or self.actions is None:
                continue
            if event in self._asked or any(element is kind for element in event.iter("*")):
                raise RefusedError(kind, f"{name!r}, which is set by what waits for it")
            rules = self._made.get(event, [])
            self._asked.add(event)
            act = next(event.iterancestors("Act"), None)
            trigger = self.actions.conditions.trigger
            starts = () if act is None else (act.find("StartTrigger"), event.find("StartTrigger"))
            when = joined("all", [trigger(start) for start in starts])
            self._asked.discard(event)
            if rules:
                when = {"rule": {"id": rules[0]["id"], "has": "started"}}
            for element in action.iter("*"):
                self.report.mark(element, "taken")
            value = new_value(action, self.actions.conditions.values.get(name, "0"))
            found.append((value, when))
        return found

    def state(self, kind: _Element) -> Made:
        """Condition of a ``StoryboardElementStateCondition``.

        Raises
        ------
        RefusedError
            If it is of a state or an element that rules do not have.
        LaterError
            If that element is none that has been read so far.
        """
        state, name = kind.get("state", ""), kind.get("storyboardElementRef", "")
        has = {
            "completeState": "ended",
            "endTransition": "ended",
            "runningState": "started",
            "startTransition": "started",
        }.get(state)
        if has is None:
            raise RefusedError(kind, f"the state {state!r}")
        bare = name.replace("::", "/").rpartition("/")[2]
        parts = [*self._begin_triggers(kind, bare)] if has == "started" else []
        for event in () if parts else self._events_in(kind, bare):
            rules = self._made.get(event, [])
            if not rules and event in self._whens:
                self.report.mark(kind, "approximated", "what it waits for does nothing")
                parts.append(self._whens[event])
            parts += [{"rule": {"id": rule["id"], "has": has}} for rule in rules]
        if not parts:
            raise LaterError(kind, f"{name!r}, which is left out or is not there")
        return joined("all" if has == "ended" else "any", parts)

    def _begin_triggers(self, kind: _Element, name: str) -> Iterator[Made]:
        """Triggers of what holds events, which starts with the act that it is in."""
        for element in kind.getroottree().getroot().iterfind("Storyboard//*[@name]"):
            if element.get("name") != name or element.tag not in _HOLDERS or self.actions is None:
                continue
            act = next(element.iterancestors("Act"), element)
            trigger = act.find("StartTrigger")
            if element.tag == "Story" or trigger is None:
                yield ALWAYS
            elif trigger in self._asked or any(element is kind for element in trigger.iter()):
                raise RefusedError(kind, f"{name!r}, which waits for this")
            else:
                self._asked.add(trigger)
                yield self.actions.conditions.trigger(trigger)
                self._asked.discard(trigger)

    def _events_in(self, kind: _Element, name: str) -> Iterator[_Element]:
        root = kind.getroottree().getroot()
        for element in root.iterfind("Storyboard/Story//*[@name]"):
            if element.get("name") == name:
                inside = element if element.tag != "Action" else element.getparent()
                if inside is not None:
                    yield from inside.iter("Event")

    def _read_act(self, act: _Element) -> None:
        trigger = self.report.child(act, "StartTrigger")
        for stop in act.iterchildren("StopTrigger"):
            if self.own:  # the end of the run, as that of the storyboard
                self.report.take(stop)
            else:
                self.report.ignore(stop, "rules end with what they do")
        for group in self.report.children(act, "ManeuverGroup"):
            if group.get("maximumExecutionCount", "1") not in {"0", "1"}:
                self.report.mark(group, "approximated", "its maneuvers take place once")
            who = self.report.child(group, "Actors")
            refs = () if who is None else self.report.children(who, "EntityRef")
            names = [ref.get("entityRef", "") for ref in refs]
            if self.own and (not names or group.get("name") in said_in_properties(names)):
                self.report.take(group)
                continue
            if self.own:
                self._read_own_rule(group, names[0])
                continue
            for maneuver in self.report.children(group, "Maneuver"):
                for event in self.report.children(maneuver, "Event"):
                    self._read_event(event, trigger, names)

    def _read_own_rule(self, group: _Element, name: str) -> None:
        """Rule of a group that odscen wrote: its events follow one another."""
        events = [
            event
            for maneuver in self.report.children(group, "Maneuver")
            for event in self.report.children(maneuver, "Event")
        ]
        before = len(self.rules)
        self._read_event(events[0], None, [name])
        if len(self.rules) == before:
            return
        rule = self.rules[-1]
        rule["id"] = group.get("name", "")
        for event in events[1:]:
            for trigger in self.report.children(event, "StartTrigger"):
                self.report.take(trigger)
                self._end_gap(rule["then"][-1], trigger)
            try:
                then = self._read_then(event, self.entities[name])
            except RefusedError as error:
                self.report.mark(error.element, "refused", error.reason)
                continue
            if then:
                rule["then"] += then if len(then) == 1 else [{"together": then}]
            self._made[event] = [rule]

    def _end_gap(self, before: Made, trigger: _Element) -> None:
        """Let a gap last as long as the event after it waits, counted from its begin."""
        condition = next(trigger.iter("Condition"), None)
        state = next(trigger.iter("StoryboardElementStateCondition"), None)
        if condition is None or state is None or state.get("state") != "startTransition":
            return
        for action in (before, *before.get("together", ())):
            if "keep_gap" in action:
                action["keep_gap"]["lasting"] = self.report.number(condition, "delay", 0.0)

    def _read_event(self, event: _Element, trigger: _Element | None, names: list[str]) -> None:
        before = len(self.rules)
        try:
            self._take_event(event, trigger, names)
        except RefusedError as error:
            if isinstance(error, LaterError) and not self._last and len(self.rules) == before:
                self._waiting.append((event, trigger, names))
                return
            self.report.mark(error.element, "refused", error.reason)
            self.report.mark(event, "refused", f"left out: {error.reason}")
        except InputError as error:
            self.report.mark(event, "refused", f"left out: {error.element}: {error.problem}")

    def _take_event(self, event: _Element, trigger: _Element | None, names: Iterable[str]) -> None:
        if self.actions is None:
            return
        conditions = self.actions.conditions
        own = self.report.child(event, "StartTrigger")
        if event.get("priority", "parallel") != "parallel":
            self.report.mark(event, "approximated", "runs beside other events of its maneuver")
        when = joined("all", [conditions.trigger(trigger), conditions.trigger(own)])
        self._whens[event] = when
        if not self.own and when == ALWAYS:
            words = "begins with the run; a player that works in steps begins it a step later"
            self.report.mark(event, "approximated", words)
        times = int(self.report.number(event, "maximumExecutionCount", 1.0))
        if not self.own:
            self._read_global_actions(event, when, times)
        if event.find("Action/PrivateAction") is None and not self.own:
            for content in event.iterfind("Action/*"):
                tell_unread(self.report, content, story=True)
            return
        for name in names:
            if name not in self.entities:
                raise RefusedError(event, f"entity {name!r} is not among the actors")
            entity = self.entities[name]
            then = self._read_then(event, entity)
            if not then:
                self.report.mark(event, "ignored", "nothing that it does has a counterpart")
            elif entity.id in self.driven:
                self.report.ignore(event, "something else drives this actor; see --ego")
            else:
                self._add_rule(event, entity.id, when, then, times)

    def _read_global_actions(self, event: _Element, when: Made, times: int) -> None:
        """Read what global actions of an event make rules of."""
        for about in event.iterfind("Action/GlobalAction/EntityAction"):
            self._read_entity_action(event, about, when, times)
        for about in event.iterfind("Action/GlobalAction/InfrastructureAction"):
            self._read_signal_action(event, about, when, times)

    def _read_signal_action(self, event: _Element, about: _Element, when: Made, times: int) -> None:
        """Let a rule switch a light; which actor it is of does not matter."""
        if self.actions is None or not self.entities:
            return
        made = self.actions.conditions.signals.action(about)
        above = about.getparent()
        for element in () if above is None else (above, above.getparent()):
            if element is not None:
                self.report.mark(element, "taken")
        self._add_rule(event, next(iter(self.entities.values())).id, when, [made], times)

    def _read_then(self, event: _Element, entity: ReadEntity) -> list[Made]:
        found: list[Made] = []
        for action in self.report.children(event, "Action"):
            content = self.report.only(action)
            kind = content.find("*") if content.tag == "GlobalAction" else None
            if kind is not None and kind.tag in READ and not self.own:
                continue
            if content.tag != "PrivateAction":
                found += self._read_global_action(content, entity)
            elif self.actions is not None:
                found += self.actions.actions(content, entity)
        if len(found) > 1 and any(FOLLOWING in action for action in found):
            raise RefusedError(event, "a speed profile beside other actions of its event")
        if len(found) == 1 and "replay" in found[0] and entity.id in self.later:
            return [{FOLLOWING: self._appear_actions(entity, found[0]["replay"]["rows"][0][1:])}]
        return with_speed(found, entity) if self.own else found

    def _read_global_action(self, content: _Element, entity: ReadEntity) -> list[Made]:
        if self.own and self.actions is not None:
            made = own_entity_action(content, entity, self.actions.conditions.positions)
            about = content.find("InfrastructureAction")
            if made is None and about is not None:
                made = self.actions.conditions.signals.action(about)
            if made is not None:
                self.report.take(content)
                return [made]
        tell_unread(self.report, content, story=True)
        return []

    def _appear_actions(self, entity: ReadEntity, at: list[float]) -> list[Made]:
        """What an actor does that the story puts on the road: it appears, and does as at first."""
        first = self.later[entity.id]
        rest = first if len(first) < 2 else [{"together": first}]
        return [{"appear": {"at": at}}, *rest]

    def _read_entity_action(self, event: _Element, about: _Element, when: Made, times: int) -> None:
        """Let an actor appear or vanish."""
        if self.actions is None:
            return
        entity = self.entities.get(about.get("entityRef", ""))
        if entity is None:
            raise RefusedError(about, f"entity {about.get('entityRef')!r} is not among the actors")
        for element in (about.getparent(), about, *about):
            if element is not None:
                self.report.mark(element, "taken")
        position = about.find("AddEntityAction/Position")
        if position is None:
            self._add_rule(event, entity.id, when, [{"vanish": {}}], times)
            return
        if entity.id not in self.later:
            raise RefusedError(about, f"{entity.id!r}, which is there already")
        self.report.mark(position, "taken")
        centre = self.actions.conditions.positions.point(position).moved(entity.ahead)
        at = [round(centre.x, 4), round(centre.y, 4), round(centre.hdg, 6)]
        self._add_rule(
            event, entity.id, when, [{FOLLOWING: self._appear_actions(entity, at)}], times
        )

    def _add_rule(
        self, event: _Element, actor: str, when: Made, then: list[Made], times: int
    ) -> None:
        rule: Made = {"id": plain_id(event.get("name", "event"), self._ids), "actor": actor}
        # What happens from the start on does so where the actor starts.
        begin: Made = {"time": {"after": JUMP}} if actor in self._placed else ALWAYS
        rule["when"] = begin if when in ({}, ALWAYS) else when
        rule["then"] = then[0].get(FOLLOWING, then) if len(then) == 1 else [{"together": then}]
        if times > 1:
            rule["times"] = min(times, 100_000)
        refuse_beyond_bounds(StoryRule, rule, event)
        self.rules.append(rule)
        self._made.setdefault(event, []).append(rule)

    def end(self, when: Made) -> None:
        """Let the run end on a condition; which actor that is a rule of does not matter."""
        if self.entities:
            actor = next(iter(self.entities.values())).id
            name = plain_id("end", self._ids)
            self.rules.append({"id": name, "actor": actor, "when": when, "then": [{"end": {}}]})

    def at_once(self, actor: str, then: list[Made], element: _Element) -> None:
        """Add what an actor does from the start, or as soon as it has appeared.

        Raises
        ------
        RefusedError
            If that is out of the bounds of rules; names the element, which is that of the actor.
        """
        if then and {"appear", "replay", "offset"} & then[0].keys():
            self._placed.add(actor)
        put = list(itertools.takewhile(lambda step: {"appear", "replay"} & step.keys(), then))
        rest = then[len(put) :]
        if put and rest:
            after = rest[0].get(FOLLOWING, rest) if len(rest) == 1 else [{"together": rest}]
            groups = [[*put, *after]]
        else:
            groups = [action.get(FOLLOWING, [action]) for action in then]
        made = [{"actor": actor, "when": ALWAYS, "then": group} for group in groups]
        for rule in made:
            refuse_beyond_bounds(StoryRule, {"id": "init", **rule}, element)
        self.rules += [{"id": plain_id(f"init-{actor}", self._ids), **rule} for rule in made]


# -------------------------------------------------------------------------- files that odscen wrote
_SAME_PLACE: Final = 1e-3
"""Metres, radians and m/s."""


def own_entity_action(
    content: _Element, entity: ReadEntity, positions: PositionReader
) -> Made | None:
    """``appear`` or ``vanish`` of an actor; ``None`` of another global action."""
    about = content.find("EntityAction")
    if about is None or about.get("entityRef") != entity.id:
        return None
    if about.find("DeleteEntityAction") is not None:
        return {"vanish": {}}
    position = about.find("AddEntityAction/Position")
    if position is None:
        return None
    at, own = positions.point(position).moved(entity.ahead), entity.own or {}
    start = positions.of_node(own.get("spawn", ""))
    if start is not None:
        start = start.moved(
            float(own.get("longitudinal_offset", 0.0)), float(own.get("lateral_offset", 0.0))
        )
        if at.away(start) < _SAME_PLACE and abs(at.hdg - start.hdg) < _SAME_PLACE:
            return {"appear": {}}
    return {"appear": {"at": [round(value, 4) for value in (at.x, at.y, at.hdg)]}}


def with_speed(then: list[Made], entity: ReadEntity) -> list[Made]:
    """Actions in which one that appears has the speed that is written beside it."""
    if len(then) < 2 or "appear" not in then[0]:
        return then
    first, *rest = then
    to = rest[0].get("speed", {}).get("to", 0.0)  # of a pedestrian at 0 a stop
    if abs(to - ((entity.own or {}).get("initial_speed") or 0.0)) > _SAME_PLACE:
        first = {"appear": first["appear"] | {"speed": to}}
    return [first, *rest[1:]]
