"""Rules in a running simulation: after each step they see the road, before the next they act."""

from __future__ import annotations

import math
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from odscen.base.frames import angle_deg_from_hdg
from odscen.records.run_events import Event, EventKind
from odscen.runs.layout import STORY_FILE, SUMO_FOLDER
from odscen.scenario.document.rules_document import actors_of, rule_parts
from odscen.scenario.story.channels import Pose, WantedMove
from odscen.scenario.story.story_engine import StoryEngine
from odscen.sumo.realize.rules.story_files import StoryPlan
from odscen.sumo.worker.simulation.moved_actors import SavedWalk
from odscen.sumo.worker.story.body_contacts import BodyContacts
from odscen.sumo.worker.story.end_watch import EndWatch
from odscen.sumo.worker.story.ground_pace import GroundPaces
from odscen.sumo.worker.story.saved_walks import mend_walks
from odscen.sumo.worker.story.story_effects import StoryEffects
from odscen.sumo.worker.story.story_view import StoryView

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping
    from pathlib import Path

    from odscen.records.run_plan import Plan
    from odscen.scenario.story.story_engine import StoryEvent
    from odscen.sumo.worker.recorder import Recorder
    from odscen.sumo.worker.simulation.moved_actors import MovedActors
    from odscen.sumo.worker.simulation.session import Session

_FREE = WantedMove()
_STEPS_AHEAD = 3.0
"""Steps before the end of a lane at which it is said where a vehicle goes on."""
_ANY_SPEED = 200.0
"""m/s."""
_MORE = frozenset({"acceleration", "travelled", "off_road", "arrive", "own"})
"""Conditions and actions that ask more of actors than where they are and how fast."""
_LASTING = frozenset({"stopped", "own"})
"""Those that ask how long actors have been standing."""


class StoryRun:
    """The rules of one run, and what SUMO was made to do for them."""

    def __init__(self, story: StoryPlan, plan: Plan) -> None:
        names = {*_names_in_story(story), *story.by_story}
        self._plan = story
        self._planned = {actor.id: actor for actor in plan.actors}
        self._actors = {actor.id: actor for actor in plan.actors if actor.id in names}
        self._paces = GroundPaces(plan.step_length)
        self._said: dict[str, float] = {}
        self._begins = False
        self._engine = StoryEngine(story.rules, step=plan.step_length, by_story=story.by_story)
        self._view = StoryView(
            story,
            self._actors,
            net_offset=plan.net_offset,
            rule_changes=self._engine.rule_changes,
            extra=self._paces.extra,
        )
        self._read_wishes(story)
        self._end = EndWatch(plan, self._view)
        self._effects = StoryEffects(
            story, self._planned, net_offset=plan.net_offset, step=plan.step_length
        )
        self._rules = story.rules
        self._contacts = BodyContacts(self._planned, plan.net_offset, story.by_story)
        self._step = plan.step_length
        self._offset = plan.net_offset
        self._road: MovedActors
        self._moves: dict[str, WantedMove] = {}
        self._walks: dict[str, SavedWalk] = {}
        self._fastest: dict[str, float] = {}
        self._waits: dict[str, Pose] = {}
        self._goal_edges: dict[str, str] = {}
        self._sent: dict[str, float] = {}
        self._lost: list[Event] = []
        self._jumps = 0

    @classmethod
    def in_folder(cls, run: Path, plan: Plan) -> StoryRun:
        """Rules of the run in a folder."""
        file = run / SUMO_FOLDER / STORY_FILE
        return cls(StoryPlan.from_json(file.read_text(encoding="utf-8")), plan)

    @classmethod
    def without_rules(cls, plan: Plan) -> StoryRun:
        """A run to which rules may come."""
        return cls(StoryPlan(()), plan)

    def add(self, text: str) -> None:
        """Add rules, the text of a story file; they act from the next look on."""
        more = StoryPlan.from_json(text)
        for rule in more.rules:
            self._engine.add(rule)
        self._rules = (*self._rules, *more.rules)
        self._plan.places.update(more.places)
        self._plan.signals.update(more.signals)
        self._read_wishes(more)
        for name in _names_in_story(more):
            if name in self._planned:
                self._actors[name] = self._planned[name]
        self._view.others_named()

    def look_always(self) -> None:
        """Look at all rules in each step: not SUMO alone drives."""
        self._engine.patient = False

    def leave_end_open(self) -> None:
        """Do not end the run with the story: a program drives, or has rules still to come."""
        self._end.watches = False

    def _read_wishes(self, story: StoryPlan) -> None:
        """Let the view read what rules ask of actors."""
        self._view.whole |= _asked_by(story, _MORE)
        self._view.always |= _asked_by(story, _LASTING)

    def begin(self, session: Session) -> None:
        """Begin with a simulation; after a saved state, do again what the state does not hold."""
        self._road = session.moved_actors()
        self._effects.begin(self._road)
        self._begins = True
        for name, move in self._moves.items():
            self._act_on_actor(self._road, name, move, None)
        self._begins = False

    def say_speeds(self) -> None:
        """Let SUMO say of whom the story drives the speeds on the ground, after each step."""
        for name, speed in self._said.items():
            self._road.say_speed(name, speed)

    @property
    def waits(self) -> bool:
        """Whether an actor may appear that is not there yet: the run is not over before."""
        return any(
            self._effects.held(rule.actor) and self._engine.may_fire(rule.id)
            for rule in self._rules
        )

    @property
    def over(self) -> bool:
        """Whether a rule has ended the run, or the story has ended and its time after that."""
        return self._effects.over or self._end.over

    @property
    def moved(self) -> frozenset[str]:
        """Who is moved by rules now."""
        return frozenset(name for name, move in self._moves.items() if move != _FREE)

    @property
    def placed(self) -> frozenset[str]:
        """Who is put somewhere by rules now, and does not only have its speed from them."""
        return frozenset(name for name, move in self._moves.items() if move.pose is not None)

    def after_step(self, time: float, recorder: Recorder) -> None:
        """Look at the road as it is at ``time``, say what rules do, and act for the next step."""
        road, moved = self._road, self._moves
        if recorder.jumps != self._jumps:
            self._jumps = recorder.jumps
            self._look_at_all()
        self._effects.departures(road)
        self._view.look(road, time, self._step, self._list_moved_person_speeds() if moved else {})
        self._effects.arrivals(road, recorder, time)
        contacts = self._contacts.look(road, self._view, moved, time, self._step)
        if self._plan.by_story:
            self._contacts.leave_out_known(recorder.events, time, self._step)
        if contacts:
            self._look_at_all()
        wanted, events = self._engine.step(self._view)
        if contacts or events:
            recorder.events.extend([*contacts, *map(self._rule_event, events)])
        self._obey_order(road, wanted, moved, recorder, time)
        recorder.events.extend(self._end.look(road, self._engine, time))

    def _obey_order(
        self,
        road: MovedActors,
        wanted: Mapping[str, WantedMove],
        moved: Mapping[str, WantedMove],
        recorder: Recorder,
        time: float,
    ) -> None:
        """Do what rules want until the next look."""
        self._said = {}
        if not moved and not wanted and not self._engine.asked:
            return
        self._lost = self._effects.lost = []
        self._effects.obey(road, self._engine.asked, time)
        self._moves = {}
        for name, move in wanted.items():
            if self._view.actor(name) is not None:
                self._act_on_actor(road, name, move, moved.get(name))
                if not move.vanishes:
                    self._moves[name] = move
        if self._lost:
            recorder.events.extend(self._lost)

    def _look_at_all(self) -> None:
        """Somebody is elsewhere than he drove."""
        self._engine.look_at_all()
        self._contacts.look_at_all()

    def _list_moved_person_speeds(self) -> dict[str, float]:
        """Speeds of persons that rules have moved, m/s."""
        return {
            name: move.speed or 0.0
            for name, move in self._moves.items()
            if move.pose is not None and self._actors[name].person
        }

    def mend(self, state: Path) -> None:
        """Let a state that SUMO has saved be one that it can load."""
        if self._sent:
            mend_walks(state, self._sent, self._road.edge_of)

    def state(self) -> dict[str, Any]:
        """What has to be remembered from one slice of a run to the next, for JSON."""
        return {
            "engine": self._engine.state(),
            "view": self._view.state(),
            "contacts": self._contacts.state(),
            "hands": self._effects.state(),
            "goal_edges": self._goal_edges,
            "sent": self._sent,
            "moves": {name: asdict(move) for name, move in self._moves.items()},
            "fastest": self._fastest,
            "waits": {name: list(pose) for name, pose in self._waits.items()},
            "walks": {name: [list(walk.edges), walk.arrival] for name, walk in self._walks.items()},
            "end": self._end.state(),
            "paces": self._paces.state(),
        }

    def restore(self, state: Mapping[str, Any]) -> None:
        """Inverse of :meth:`state`."""
        self._engine.restore(state["engine"])
        self._view.restore(state["view"])
        self._contacts.restore(state["contacts"])
        self._effects.restore(state["hands"])
        if "end" in state:
            self._end.restore(state["end"])
        self._paces.restore(state.get("paces", {}))
        self._goal_edges = dict(state["goal_edges"])
        self._sent = dict(state["sent"])
        for name, kept in state["moves"].items():
            pose = kept["pose"]
            lights = None if kept["lights"] is None else tuple(kept["lights"])
            pose = None if pose is None else Pose(*_pose_numbers(pose))
            data = {**kept, "pose": pose, "goal": None, "lights": lights}
            self._moves[name] = WantedMove(**data)
        self._fastest = dict(state["fastest"])
        self._waits = {name: Pose(*_pose_numbers(pose)) for name, pose in state["waits"].items()}
        self._walks = {
            name: SavedWalk(tuple(edges), arrival)
            for name, (edges, arrival) in state["walks"].items()
        }

    def _act_on_actor(
        self, road: MovedActors, name: str, move: WantedMove, before: WantedMove | None
    ) -> None:
        if move.vanishes:
            road.remove(name, person=self._actors[name].person)
        elif self._actors[name].person:
            self._move_person(road, name, move, before)
        else:
            self._move_vehicle(road, name, move, before or _FREE)

    def _move_vehicle(
        self, road: MovedActors, name: str, move: WantedMove, before: WantedMove
    ) -> None:
        speed = self._speed_for_sumo(name, move)
        ignored = move.ignore_red, move.ignore_right_of_way
        changed = ignored != (before.ignore_red, before.ignore_right_of_way)
        if changed or move.speed is not None or before.speed is not None:
            self._allow_speed(road, name, speed)
            road.drive(
                name,
                speed,
                exact=move.exact,
                ignore_red=move.ignore_red,
                ignore_right_of_way=move.ignore_right_of_way,
            )
        if move.lights != before.lights:
            road.show_lights(name, move.lights)
        if move.keeps_lane != before.keeps_lane:
            road.keep_lane(name, keeps=move.keeps_lane)
        self._keep_goal(road, name, move)
        if move.follows_lane:
            road.follow_lane(name, within=_STEPS_AHEAD * (move.speed or 0.0) * self._step)
        if (pose := move.pose) is not None:
            x, y = pose.x + self._offset[0], pose.y + self._offset[1]
            road.put_vehicle(name, x, y, float(angle_deg_from_hdg(pose.hdg)))

    def _speed_for_sumo(self, name: str, move: WantedMove) -> float | None:
        """Speed that makes that of a move on the ground; other than along a lane they are one."""
        if not (move.follows_lane and move.exact) or move.speed is None:
            self._paces.rest(name)
            return move.speed
        speed: float | None
        if self._begins:
            speed = self._paces.given(name)
        else:
            actor = self._view.actor(name)
            speed = move.speed if actor is None else self._paces.speed(actor, move.speed)
        if speed is None:
            return move.speed
        if speed != move.speed:
            self._said[name] = move.speed
        return speed

    def _keep_goal(self, road: MovedActors, name: str, move: WantedMove) -> None:
        """Keep the goal of a vehicle that is put somewhere: SUMO forgets its route beside it."""
        if move.goal is not None:
            self._goal_edges.pop(name, None)
            self._effects.new_goal(road, name, move.goal, self._view.time)
        if move.pose is not None:
            self._goal_edges.setdefault(name, road.goal_edge(name))
            return
        edge = self._goal_edges.pop(name, None)
        if edge is None:
            return
        if road.goal_edge(name) != edge and not road.lead_to(name, edge):
            self._lose_way(name, "no route leads from where it is to its goal")
        if name in self._plan.without_goal:  # it would stop for a gap back to the lane it came from
            road.follow_lane(name, within=math.inf)

    def _allow_speed(self, road: MovedActors, name: str, speed: float | None) -> None:
        """Let a vehicle go faster than its type, while a rule wants it."""
        own = self._fastest.get(name)
        if speed is None:
            if own is not None:
                road.limit(name, self._fastest.pop(name))
        elif own is None and speed > (allowed := road.fastest(name)):
            self._fastest[name] = allowed
            road.limit(name, _ANY_SPEED)

    def _move_person(
        self, road: MovedActors, name: str, move: WantedMove, before: WantedMove | None
    ) -> None:
        if move.goal is not None:
            self._new_walk(road, name, move)
        if move.pose is not None:
            if name not in self._walks:
                self._walks[name] = road.saved_walk(name)
            self._waits.pop(name, None)
            self._put_person(road, name, move.pose)
            return
        if move.rejoins and name in self._walks:
            if self._resume_walk(road, name, self._walks[name]):
                del self._walks[name]
            elif (body := self._view.actor(name)) is not None:
                self._waits[name] = Pose(body.x, body.y, body.hdg)
                why = "there is no sidewalk to resume its walk on; it stays where it is"
                self._lose_way(name, why)
        if (pose := self._waits.get(name)) is not None:
            self._put_person(road, name, pose)
            return
        speed = move.speed
        if speed is None and before is not None and before.speed is not None:
            speed = self._view.walking_speed(name)
        if speed is not None:
            road.walk_speed(name, speed)

    def _new_walk(self, road: MovedActors, name: str, move: WantedMove) -> None:
        walk = self._effects.new_goal(road, name, move.goal or "", self._view.time)
        if walk is not None and (name in self._walks or move.pose is not None):
            self._walks[name] = walk
        elif walk is not None and not self._resume_walk(road, name, walk):
            self._lose_way(name, "no walk leads from where it is to its new goal")

    def _resume_walk(self, road: MovedActors, name: str, walk: SavedWalk) -> bool:
        resumes = road.resume_walk(name, walk)
        if resumes:
            self._sent[name] = walk.arrival
        return resumes

    def _put_person(self, road: MovedActors, name: str, pose: Pose) -> None:
        half = self._actors[name].length / 2.0
        x = pose.x + half * math.cos(pose.hdg) + self._offset[0]
        y = pose.y + half * math.sin(pose.hdg) + self._offset[1]
        angle = float(angle_deg_from_hdg(pose.hdg))
        # Who goes nowhere, as those of recordings, need not find back to a walk.
        road.put_person(name, x, y, angle, only_on_lanes=name in self._plan.without_goal)

    def _lose_way(self, name: str, why: str) -> None:
        """Say that SUMO cannot lead an actor on; a person would end it in a fault."""
        body = self._view.actor(name)
        x, y = (None, None) if body is None else (body.x, body.y)
        time = self._view.time
        self._lost.append(Event(time, EventKind.RULE_FAILED, name, x=x, y=y, detail=why))

    def _rule_event(self, event: StoryEvent) -> Event:
        body = self._view.actor(event.actor)
        return Event(
            event.time,
            EventKind(f"rule_{event.what}"),
            event.actor,
            x=None if body is None else body.x,
            y=None if body is None else body.y,
            detail=event.detail,
            rule=event.rule,
            values=event.values,
        )


def _names_in_story(story: StoryPlan) -> Iterator[str]:
    for rule in story.rules:
        yield rule.actor
        for _, _, part in rule_parts(rule, ""):
            for _, name in actors_of(part):
                yield name


def _asked_by(story: StoryPlan, kinds: frozenset[str]) -> set[str]:
    """Actors of whom conditions and actions of some kinds ask."""
    return {
        name
        for rule in story.rules
        for _, kind, part in rule_parts(rule, "")
        if kind in kinds
        for name in (rule.actor, *(name for _, name in actors_of(part)))
    }


def _pose_numbers(pose: Any) -> tuple[float, float, float]:
    x, y, hdg = pose
    return float(x), float(y), float(hdg)
