"""Rules over a run: which fire when, what they do to whom, and what is said of it.

Each step the engine is shown the road as it is at ``view.time`` and says what is wanted of the
actors until the next look. Within the step it goes from instant to instant: a rule fires, an action
ends, the next begins, another rule has waited for that.
"""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple

from odscen.scenario.story.channels import ActingActor, CannotAct, Channel, WantedMove
from odscen.scenario.story.condition_tree import NEVER_IN_STEP, ConditionTree
from odscen.scenario.story.own_kinds import action_kind
from odscen.scenario.story.quiet_spells import QuietSpells

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from odscen.scenario.document.rules_document import Action, StoryRule
    from odscen.scenario.story.action_kinds import ActionKind, Wanted
    from odscen.scenario.story.road_view import RoadView


@dataclass
class Running:
    """An action that runs: its place in the item of ``then``, and when it is over."""

    number: int
    end: float

    def state(self) -> dict[str, Any]:
        """Values that JSON can hold."""
        return {"number": self.number, "end": None if self.end == math.inf else self.end}

    @classmethod
    def from_state(cls, state: Mapping[str, Any]) -> Running:
        """Inverse of :meth:`state`."""
        return cls(state["number"], math.inf if state["end"] is None else state["end"])


@dataclass
class RuleState:
    """A rule: how often it has fired, what it does, and when it may fire again.

    ``started`` and ``ended`` have the first instant of each, if there was one.
    """

    fired: int = 0
    ready: float = 0.0
    item: int | None = None
    running: list[Running] = field(default_factory=list)
    started: list[float] = field(default_factory=list)
    ended: list[float] = field(default_factory=list)


STARTED, ENDED, FAILED, OVERRIDDEN = "started", "ended", "failed", "overridden"
ACTED = "acted"
"""What can be said of a rule."""

_FREE = WantedMove()
_MOST_TURNS = 1000
"""Instants in one step; a rule that restarts at once, for ever, must not hold up the run."""


class StoryEvent(NamedTuple):
    """What a rule did at an instant; ``values`` are what its conditions were about."""

    time: float
    what: str
    rule: str
    actor: str
    detail: str | None = None
    values: dict[str, float] | None = None


class StoryEngine:
    """The rules of one run.

    Parameters
    ----------
    step
        Seconds between two looks.

    Attributes
    ----------
    patient
        Whether rules that cannot fire yet are left alone, as SUMO alone drives whom no rule moves.
    """

    def __init__(self, rules: Sequence[StoryRule], *, step: float) -> None:
        self.patient = True
        self._rules = {rule.id: rule for rule in rules}
        self._step = step
        self._trees = {rule.id: ConditionTree(rule, step) for rule in rules}
        self._quiet = QuietSpells(step)
        self._looked: dict[str, ConditionTree] = {}
        self._nothing_before = -math.inf
        self._states = {rule.id: RuleState() for rule in rules}
        self._busy: set[str] = set()
        self._channels: dict[str, Channel] = {}
        self._events: list[StoryEvent] = []
        self._asked: list[Wanted] = []

    def rule_changes(self, rule: str, has: str) -> tuple[float, ...]:
        """Instants at which a rule has first started, or ended."""
        state = self._states.get(rule)
        if state is None:
            return ()
        return tuple(state.started if has == STARTED else state.ended)

    @property
    def asked(self) -> Sequence[Wanted]:
        """What the last step wants that is no motion: actors and switched lights, in order."""
        return self._asked

    def add(self, rule: StoryRule) -> None:
        """Add a rule to those that there are."""
        self._rules[rule.id] = rule
        self._trees[rule.id] = ConditionTree(rule, self._step)
        self._states[rule.id] = RuleState()
        self._nothing_before = -math.inf

    def look_at_all(self) -> None:
        """Look at all rules in the next step: somebody is elsewhere than he drove."""
        self._quiet.end()
        self._nothing_before = -math.inf

    def may_fire(self, rule: str) -> bool:
        """Whether a rule can fire yet, or is about something."""
        state = self._states[rule]
        return state.item is not None or state.fired < self._rules[rule].times

    def step(self, view: RoadView) -> tuple[dict[str, WantedMove], list[StoryEvent]]:
        """Look at the road; what is wanted of whom until the next look, and what happened."""
        self._events, self._asked = [], []
        if view.time < self._nothing_before:
            return {}, self._events
        self._begin_step(view)
        now = view.time
        for _ in range(_MOST_TURNS):
            turn = self._next_turn(view, now)
            if turn is None:
                break
            now, rule = turn
            self._turn_rule(view, now, self._rules[rule])
        for tree in self._looked.values():
            tree.next_step()
        self._looked = {}
        self._nothing_before = self._until_something(view.time)
        moves = {}
        for name, channel in sorted(self._channels.items()):
            if (one := view.actor(name)) is not None:
                moves[name] = channel.end_step(view.time, self._step, person=one.person)
                if moves[name] == _FREE and channel.idle and not one.person:
                    del self._channels[name]
        return moves, self._events

    def state(self) -> dict[str, Any]:
        """What has to be remembered from one slice of a run to the next, for JSON."""
        kept = [tree.state() for tree in self._trees.values()]
        return {
            "trees": {
                "leaves": {key: one for leaves, _ in kept for key, one in leaves.items()},
                "past": {key: one for _, past in kept for key, one in past.items()},
            },
            "quiet": self._quiet.state(),
            "rules": {
                name: {**asdict(state), "running": [action.state() for action in state.running]}
                for name, state in self._states.items()
            },
            "channels": {name: one.state() for name, one in self._channels.items()},
        }

    def restore(self, state: Mapping[str, Any]) -> None:
        """Inverse of :meth:`state`."""
        self._nothing_before = -math.inf
        for tree in self._trees.values():
            tree.restore(state["trees"]["leaves"], state["trees"]["past"])
        self._quiet.restore(state.get("quiet", {}), self._rules)
        for name, kept in state["rules"].items():
            running = [Running.from_state(saved) for saved in kept["running"]]
            self._states[name] = RuleState(**{**kept, "running": running})
        self._busy = {name for name, one in self._states.items() if one.item is not None}
        self._channels = {name: Channel.from_state(one) for name, one in state["channels"].items()}

    def _begin_step(self, view: RoadView) -> None:
        for name in list(self._channels):
            actor = view.actor(name)
            if actor is None:
                del self._channels[name]
                self._end_gone_actor(view, name)
            else:
                self._channels[name].begin_step(actor, view.time)
        if not self._busy:
            return
        for name, rule in self._rules.items():
            if running := self._states[name].running:
                for action in list(running):
                    self._update_action(view, rule, action, view.time)

    def _end_gone_actor(self, view: RoadView, actor: str) -> None:
        """End what an actor does that has left the road."""
        for name, rule in self._rules.items():
            if rule.actor == actor and self._states[name].item is not None:
                vanished = any(item.vanish for item in rule.then)
                if not vanished:
                    self._say_event(view.time, FAILED, rule, "it has left the road")
                self._end_rule(rule, view.time)

    def _until_something(self, time: float) -> float:
        """Instant before which nothing can happen if nobody is put elsewhere."""
        if self._channels or self._busy:
            return -math.inf
        least = math.inf
        for name, rule in self._rules.items():
            if self._states[name].fired < rule.times:
                least = min(least, self._quiet.until.get(name, -math.inf))
                if least <= time:
                    return -math.inf
        return least

    def _next_turn(self, view: RoadView, now: float) -> tuple[float, str] | None:
        """First instant at which something happens, and the rule to which it does."""
        found: tuple[float, str] | None = None
        time, until = view.time, self._quiet.until
        first = time + self._step
        end = first
        for name, rule in self._rules.items():
            state = self._states[name]
            if state.item is not None:
                due = max(min((action.end for action in state.running), default=now), now)
                instant = due if due < end else None
            elif state.fired < rule.times and time >= until.get(name, time):
                instant = self._next_firing(rule, state, view, now, end)
            else:
                continue
            if instant is not None and instant < first:  # of several at once the first one
                first, found = instant, (instant, name)
        return found

    def _next_firing(
        self, rule: StoryRule, state: RuleState, view: RoadView, now: float, end: float
    ) -> float | None:
        """Instant from ``now`` on, before ``end``, at which a rule fires."""
        tree = self._looked[rule.id] = self._trees[rule.id]
        holds = tree.look(view)
        if state.fired:
            instant = holds.first_rise(now, end, after=state.ready)
        else:
            instant = holds.first(now, end)
        if (
            instant is None
            and self.patient
            and holds == NEVER_IN_STEP
            and self._quiet.begins(rule, view, self._channels)
        ):
            tree.forget()
        return instant

    def _turn_rule(self, view: RoadView, now: float, rule: StoryRule) -> None:
        state = self._states[rule.id]
        if state.item is None:
            self._fire_rule(view, now, rule)
            return
        for ended in [ended for ended in state.running if ended.end <= now]:
            state.running.remove(ended)
            self._finish_action(view, now, rule, ended)
        if not state.running:
            self._next_item(view, now, rule)

    def _fire_rule(self, view: RoadView, now: float, rule: StoryRule) -> None:
        state = self._states[rule.id]
        state.fired += 1
        state.item = -1
        self._busy.add(rule.id)
        state.started = state.started or [now]
        values = self._trees[rule.id].values(now - view.time)
        self._say_event(now, STARTED, rule, values=values or None)
        self._next_item(view, now, rule)

    def _next_item(self, view: RoadView, now: float, rule: StoryRule) -> None:
        """Begin the next item of ``then``; the rule has ended after the last."""
        state = self._states[rule.id]
        state.item = 0 if state.item is None else state.item + 1
        if state.item >= len(rule.then):
            self._say_event(now, ENDED, rule)
            self._end_rule(rule, now)
            return
        for number, action in enumerate(rule.then[state.item].parts):
            one = Running(number, math.inf)
            state.running.append(one)
            self._begin_action(view, now, rule, action, one)
            if state.item is None:  # that failed
                return

    def _begin_action(
        self, view: RoadView, now: float, rule: StoryRule, action: Action, running: Running
    ) -> None:
        kind, part = action_kind(action), getattr(action, action.kind)
        try:
            if kind.ask is not None:
                self._asked.append(kind.ask(part, rule.actor, view))
                running.end = math.inf if kind.update else now
            else:
                self._begin_motion(view, now, rule, kind, part, running)
        except CannotAct as error:
            self._fail_rule(rule, now, str(error))
            return
        if kind.says is not None:
            self._say_event(now, ACTED, rule, kind.says(part))

    def _begin_motion(
        self,
        view: RoadView,
        now: float,
        rule: StoryRule,
        kind: ActionKind,
        part: Any,
        running: Running,
    ) -> None:
        """Begin an action of an actor that is on the road."""
        acting = self._acting_actor(view, now, rule, running)
        channel, person = acting.channel, acting.actor.person
        if (kind.persons_only and not person) or (kind.vehicles_only and person):
            raise CannotAct(f"{kind.name!r} is not for {'a person' if person else 'a vehicle'}")
        owners = channel.speed_owner, channel.line_owner
        running.end = now if kind.begin is None else kind.begin(part, acting)
        if running.end == math.inf and kind.update is not None:
            running.end = kind.update(part, acting, running.end)
        after = channel.speed_owner, channel.line_owner
        for owner, new in zip(owners, after, strict=True):
            if owner is not None and new != owner:
                self._override_action(owner, now, rule)

    def _update_action(self, view: RoadView, rule: StoryRule, running: Running, now: float) -> None:
        state = self._states[rule.id]
        if view.actor(rule.actor) is None or state.item is None:
            return
        action = rule.then[state.item].parts[running.number]
        kind = action_kind(action)
        if kind.update is None:
            return
        try:
            acting = self._acting_actor(view, now, rule, running)
            running.end = kind.update(getattr(action, action.kind), acting, running.end)
        except CannotAct as error:
            self._fail_rule(rule, now, str(error))

    def _finish_action(self, view: RoadView, now: float, rule: StoryRule, running: Running) -> None:
        action = rule.then[self._states[rule.id].item or 0].parts[running.number]
        kind = action_kind(action)
        if kind.finish is not None and view.actor(rule.actor) is not None:
            kind.finish(getattr(action, action.kind), self._acting_actor(view, now, rule, running))

    def _acting_actor(
        self, view: RoadView, now: float, rule: StoryRule, running: Running
    ) -> ActingActor:
        actor = view.actor(rule.actor)
        if actor is None:
            raise CannotAct(f"{rule.actor!r} is not on the road")
        channel = self._channels.get(actor.id)
        if channel is None:
            channel = self._channels[actor.id] = Channel()
            self._quiet.end(actor.id)
            channel.begin_step(actor, view.time)
        owner = f"{rule.id}/{running.number}"
        return ActingActor(view, actor, channel, now, self._step, owner, self._channels)

    def _override_action(self, owner: str, now: float, by: StoryRule) -> None:
        """End an action of another rule, as ``by`` has taken over what it had."""
        name, _, number = owner.rpartition("/")
        state = self._states[name]
        if name == by.id:
            return
        before = len(state.running)
        state.running = [action for action in state.running if action.number != int(number)]
        if len(state.running) < before:
            rule = self._rules[name]
            self._say_event(now, OVERRIDDEN, rule, f"rule {by.id!r} acts instead")
            if not state.running:
                self._end_rule(rule, now)

    def _fail_rule(self, rule: StoryRule, now: float, why: str) -> None:
        self._say_event(now, FAILED, rule, why)
        channel = self._channels.get(rule.actor)
        if channel is not None:
            if (channel.line_owner or "").rpartition("/")[0] == rule.id and not channel.held:
                channel.release_line()
            if (channel.speed_owner or "").rpartition("/")[0] == rule.id:
                channel.release_speed(now)
        self._end_rule(rule, now)

    def _end_rule(self, rule: StoryRule, now: float) -> None:
        state = self._states[rule.id]
        state.item, state.ready = None, now
        self._busy.discard(rule.id)
        state.running = []
        state.ended = state.ended or [now]

    def _say_event(
        self,
        now: float,
        what: str,
        rule: StoryRule,
        detail: str | None = None,
        values: dict[str, float] | None = None,
    ) -> None:
        self._events.append(StoryEvent(now, what, rule.id, rule.actor, detail, values))
