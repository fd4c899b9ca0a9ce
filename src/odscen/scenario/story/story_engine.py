"""Rules over a run: which fire when, what they do to whom, and what is said of it.

Each step the engine is shown the road as it is at ``view.time`` and says what is wanted of the
actors until the next look. Within the step it goes from instant to instant: a rule fires, an action
ends, the next begins, another rule has waited for that.

Rules that cannot fire yet are not looked at: until when, follows from how fast bodies can be.

Most conditions of most rules are far from met: the other one is two streets away, or the light is a
minute off. Who drives as SUMO lets him drive gains no more than his vehicle can, so that such a
condition stays unmet for a while that can be told. A rule is looked at again :data:`BEFORE` steps
before, as the instant at which it comes true follows from its last two readings.
"""

from __future__ import annotations

import math
from dataclasses import asdict
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NamedTuple

from odscen.scenario.document.rules_document import actors_of, rule_parts
from odscen.scenario.story.channels import ActingActor, CannotAct, Channel, WantedMove
from odscen.scenario.story.condition_tree import CLOSE, NEVER_IN_STEP, ConditionTree
from odscen.scenario.story.own_kinds import action_kind
from odscen.scenario.story.rule_states import RuleState, Running
from odscen.scenario.story.story_end import longest_delay, story_has_ended

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Mapping, Sequence

    from odscen.scenario.document.rules_document import (
        Action,
        AfterTime,
        Condition,
        DistanceBounded,
        OwnBounded,
        Reaching,
        StoryRule,
    )
    from odscen.scenario.story.action_kinds import ActionKind, Wanted
    from odscen.scenario.story.road_view import ActorView, Point, RoadView


# ----------------------------------------------------- rules that cannot fire yet are not looked at
BEFORE = 3
"""Steps."""
LONGEST = 10.0
"""Seconds; for longer the bound says little."""
_ASIDE = 8.0
"""Metres that changes of lanes put a vehicle aside at once: two of them."""
_RUNS = 10.0
"""m/s; nobody on foot is faster, and SUMO lets a person have any speed at once."""
_AGAIN = 5
"""Steps after which it is asked again for how long a rule is far from met."""


class QuietSpells:
    """Until when each rule need not be looked at.

    Parameters
    ----------
    step
        Seconds between two looks.

    Attributes
    ----------
    until
        Instant before which a rule is not looked at, of those of which there is one.
    """

    def __init__(self, step: float) -> None:
        self.until: dict[str, float] = {}
        self._step = step
        self._ask: dict[str, float] = {}
        self._actors: dict[str, frozenset[str]] = {}
        self._tellers: dict[str, _QuietTeller | None] = {}

    def begins(self, rule: StoryRule, view: RoadView, moved: Collection[str]) -> bool:
        """Whether a rule whose condition is not met, and will not be in this step, is left now."""
        name = rule.id
        if name not in self._tellers:
            self._tellers[name] = _make_teller(rule.when) if _can_be_told(rule) else None
            self._actors[name] = _actors_of_rule(rule)
        teller, time = self._tellers[name], view.time
        if teller is None or time < self._ask.get(name, time):
            return False
        if not self._actors[name].isdisjoint(moved):
            return False
        seconds = min(quiet_seconds(teller, rule.actor, view), LONGEST)
        until = time + seconds - BEFORE * self._step
        if until <= time + self._step:
            self._ask[name] = time + _AGAIN * self._step
            return False
        self.until[name] = until
        return True

    def end(self, actor: str | None = None) -> None:
        """Look again at the rules about an actor, who is moved, or at all."""
        if actor is None:
            self.until.clear()
        else:
            for name in [name for name in self.until if actor in self._actors[name]]:
                del self.until[name]

    def state(self) -> dict[str, float]:
        """What has to be remembered, for JSON."""
        return dict(self.until)

    def restore(self, state: Mapping[str, float], rules: Mapping[str, StoryRule]) -> None:
        """Inverse of :meth:`state`."""
        for name, until in state.items():
            self._actors[name] = _actors_of_rule(rules[name])
            self.until[name] = until


def quiet_seconds(teller: _QuietTeller, actor: str, view: RoadView) -> float:
    """Seconds for which a condition that is not met surely stays so; 0 if that cannot be told."""
    tell, part, below, every = teller
    if tell is not None:
        seconds = tell(part, actor, view)
        return max(0.0, seconds)
    if not below:
        return 0.0
    parts = [quiet_seconds(inner, actor, view) for inner in below]
    return max(parts) if every else min(parts)


class _QuietTeller(NamedTuple):
    """A condition, taken apart once: a leaf that can be told, or what it is combined of."""

    tell: Callable[[Any, str, RoadView], float] | None
    part: Any
    below: tuple[_QuietTeller, ...] = ()
    every: bool = False


def _make_teller(condition: Condition) -> _QuietTeller:
    kind = condition.kind
    part = getattr(condition, kind)
    if kind in ("all", "any"):
        return _QuietTeller(None, None, tuple(map(_make_teller, part)), kind == "all")
    return _QuietTeller(_TELL.get(kind), part)


def _can_be_told(rule: StoryRule) -> bool:
    """Whether a rule can be left alone at all: not if something remembers each step of it."""
    return not _has_memory(rule.when) and _can_tell(rule.when)


def _can_tell(condition: Condition) -> bool:
    kind = condition.kind
    if kind in ("all", "any"):
        parts = map(_can_tell, getattr(condition, kind))
        return any(parts) if kind == "all" else all(parts)
    return kind in _TELL


def _has_memory(condition: Condition) -> bool:
    if condition.delay or condition.edge == "rising" or condition.kind == "own":
        return True
    if condition.kind == "not_":
        return condition.not_ is not None and _has_memory(condition.not_)
    parts = getattr(condition, condition.kind) if condition.kind in ("all", "any") else ()
    return any(map(_has_memory, parts))


def _actors_of_rule(rule: StoryRule) -> frozenset[str]:
    parts = rule_parts(rule, "")
    return frozenset((rule.actor, *(name for _, _, part in parts for _, name in actors_of(part))))


def _seconds_to_cover(metres: float, speed: float, gain: float) -> float:
    """Seconds in which so many metres are covered at the earliest."""
    if metres <= CLOSE:
        return 0.0
    if gain <= 0.0:
        return metres / speed if speed > 0.0 else math.inf
    return (math.sqrt(speed * speed + 2.0 * gain * metres) - speed) / gain


def _quiet_until_time(part: AfterTime, _: str, view: RoadView) -> float:
    return part.after - view.time


def _quiet_until_speed(part: OwnBounded, actor: str, view: RoadView) -> float:
    if part.above is None:  # whoever collides stands at once
        return 0.0
    actor_view = view.actor(part.of or actor)
    if actor_view is None:
        return _quiet_while_absent(view, part.of or actor)
    if actor_view.person:
        return 0.0
    if part.above - actor_view.speed <= CLOSE:
        return 0.0
    return (part.above - actor_view.speed) / actor_view.gain if actor_view.gain > 0.0 else LONGEST


def _quiet_until_travelled(part: OwnBounded, actor: str, view: RoadView) -> float:
    if part.above is None:
        return 0.0
    actor_view = view.actor(part.of or actor)
    if actor_view is None:
        return _quiet_while_absent(view, part.of or actor)
    return _seconds_to_cover(part.above - actor_view.travelled, *_speed_and_gain(actor_view))


def _quiet_while_absent(view: RoadView, *actors: str) -> float:
    """Seconds for which a condition on actors, one of whom is not there, is not met."""
    return LONGEST if any(map(view.gone, actors)) else 0.0


def _speed_and_gain(actor_view: ActorView) -> tuple[float, float]:
    """Speed, and how much of it can be gained in a second."""
    return (
        (max(actor_view.speed, _RUNS), 0.0)
        if actor_view.person
        else (actor_view.speed, actor_view.gain)
    )


def _farthest_reach(actor_view: ActorView) -> float:
    """Metres from the centre of a body, with and without it, and of lanes beside."""
    return (actor_view.length + actor_view.width) / 2.0 + (0.0 if actor_view.person else _ASIDE)


def _quiet_until_reached(part: Reaching, actor: str, view: RoadView) -> float:
    return _seconds_to_point(part.of or actor, view.place(part.place), part.within, view)


def _quiet_until_distance(part: DistanceBounded, actor: str, view: RoadView) -> float:
    if part.below is None or part.along != "straight":
        return 0.0  # along a heading it is another as soon as somebody turns
    name = part.of or actor
    if part.to is None:
        return _seconds_to_point(name, view.place(part.place or ""), part.below, view)
    one, other = view.actor(name), view.actor(part.to)
    if one is None or other is None:
        return _quiet_while_absent(view, name, part.to)
    away = math.dist((one.x, one.y), (other.x, other.y)) - part.below
    (speed, gain), (speeds, gains) = _speed_and_gain(one), _speed_and_gain(other)
    return _seconds_to_cover(
        away - _farthest_reach(one) - _farthest_reach(other), speed + speeds, gain + gains
    )


def _seconds_to_point(actor: str, point: Point, bound: float, view: RoadView) -> float:
    actor_view = view.actor(actor)
    if actor_view is None:
        return _quiet_while_absent(view, actor)
    away = math.dist((actor_view.x, actor_view.y), point) - _farthest_reach(actor_view) - bound
    return _seconds_to_cover(away, *_speed_and_gain(actor_view))


_TELL: dict[str, Callable[[Any, str, RoadView], float]] = {
    "distance": _quiet_until_distance,
    "reaches": _quiet_until_reached,
    "speed": _quiet_until_speed,
    "time": _quiet_until_time,
    "travelled": _quiet_until_travelled,
}


# ----------------------------------------------------------------------------- rules over a run
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
    by_story
        Speeds, m/s, at which the story alone begins to drive vehicles, by their ids; ``None`` is
        that at which the vehicle is first seen.

    Attributes
    ----------
    patient
        Whether rules that cannot fire yet are left alone, as SUMO alone drives whom no rule moves.
    """

    def __init__(
        self,
        rules: Sequence[StoryRule],
        *,
        step: float,
        by_story: Mapping[str, float | None] = MappingProxyType({}),
    ) -> None:
        self.patient = True
        self._by_story = by_story
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

    @property
    def has_rules(self) -> bool:
        """Whether there are any."""
        return bool(self._rules)

    def has_ended(self, now: float, *, gone: Callable[[str], bool], still: bool) -> bool:
        """Whether no rule is under way and none can fire any more.

        See :func:`~odscen.scenario.story.story_end.story_has_ended`.
        """
        return story_has_ended(self._rules, self._states, now=now, gone=gone, still=still)

    def longest_delay(self) -> float:
        """Seconds after which a condition that has held may still let a rule fire."""
        return longest_delay(self._rules, self._states)

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
        self._nothing_before = self._find_quiet_end(view.time)
        moves = {}
        for name, channel in sorted(self._channels.items()):
            if (body := view.actor(name)) is not None:
                moves[name] = channel.end_step(view.time, self._step, person=body.person)
                if moves[name] == _FREE and channel.idle and not body.person:
                    del self._channels[name]
        return moves, self._events

    def state(self) -> dict[str, Any]:
        """What has to be remembered from one slice of a run to the next, for JSON."""
        kept = [tree.state() for tree in self._trees.values()]
        return {
            "trees": {
                "leaves": {key: memory for leaves, _ in kept for key, memory in leaves.items()},
                "past": {key: flips for _, past in kept for key, flips in past.items()},
            },
            "quiet": self._quiet.state(),
            "rules": {
                name: {**asdict(state), "running": [action.state() for action in state.running]}
                for name, state in self._states.items()
            },
            "channels": {name: channel.state() for name, channel in self._channels.items()},
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
        self._busy = {name for name, state in self._states.items() if state.item is not None}
        self._channels = {
            name: Channel.from_state(saved) for name, saved in state["channels"].items()
        }

    def _begin_step(self, view: RoadView) -> None:
        for name, speed in self._by_story.items():
            actor = None if name in self._channels else view.actor(name)
            if actor is not None:
                channel = self._add_channel(actor, view.time)
                channel.drive_by_story(view.time, speed)
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

    def _find_quiet_end(self, time: float) -> float:
        """Instant before which nothing can happen if nobody is put elsewhere."""
        if self._channels or self._busy or self._by_story:
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
            begun = Running(number, math.inf)
            state.running.append(begun)
            self._begin_action(view, now, rule, action, begun)
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
            channel = self._add_channel(actor, view.time)
        owner = f"{rule.id}/{running.number}"
        return ActingActor(view, actor, channel, now, self._step, owner, self._channels)

    def _add_channel(self, actor: ActorView, time: float) -> Channel:
        channel = Channel(usually_by_story=actor.id in self._by_story)
        self._channels[actor.id] = channel
        self._quiet.end(actor.id)
        channel.begin_step(actor, time)
        return channel

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
