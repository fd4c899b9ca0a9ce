"""What rules want of SUMO that is no motion: who appears, signals, and goals."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from odscen.base.frames import angle_deg_from_hdg
from odscen.records.run_events import Event, EventKind
from odscen.scenario.story.action_kinds import WantedActor, WantedEnd
from odscen.sumo.worker.simulation.moved_actors import DARK, SavedWalk

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from odscen.records.run_plan import PlannedActor
    from odscen.scenario.story.action_kinds import Wanted, WantedSignal
    from odscen.sumo.realize.rules.story_files import StoryPlan
    from odscen.sumo.worker.recorder import Recorder
    from odscen.sumo.worker.simulation.moved_actors import MovedActors


class StoryEffects:
    """Puts actors on the road, switches lights and leads to goals, as rules ask.

    After a saved state is loaded it does again what such a state does not hold.

    Attributes
    ----------
    lost
        What could not be done since it was last emptied.
    over
        Whether a rule has ended the run.
    """

    def __init__(
        self,
        plan: StoryPlan,
        actors: Mapping[str, PlannedActor],
        *,
        net_offset: tuple[float, float],
        step: float,
    ) -> None:
        self.lost: list[Event] = []
        self.over = False
        self._plan = plan
        self._actors = actors
        self._offset, self._step = net_offset, step
        self._added: set[str] = set()
        self._dark: dict[str, str] = {}  # program of each light before it went dark
        self._goals: dict[str, str] = {}  # place in the plan, by actor
        # Speeds faster than SUMO lets the actors depart; they are given a step later.
        self._faster: dict[str, float] = {}

    def begin(self, road: MovedActors) -> None:
        """Begin with a simulation; a saved state forgets that a light is off."""
        for light in self._dark:
            road.run_program(light, DARK)

    def held(self, name: str) -> bool:
        """Whether an actor has not appeared yet."""
        return name in self._plan.held and name not in self._added

    def obey(self, road: MovedActors, asked: Sequence[Wanted], time: float) -> None:
        """Do what rules have asked for in this step."""
        for wish in asked:
            if isinstance(wish, WantedActor):
                self._put_on_road(road, wish, time)
            elif isinstance(wish, WantedEnd):
                self.over = True
            else:
                self._switch_light(road, wish, time)

    def departures(self, road: MovedActors) -> None:
        """Give those who have appeared the speed with which SUMO would not have let them depart."""
        for name, speed in list(self._faster.items()):
            if road.motion(name) is not None:
                road.begin_at(name, speed)
                del self._faster[name]

    def arrivals(self, road: MovedActors, recorder: Recorder, time: float) -> None:
        """Let those arrive who have come to the goal that a rule has given them."""
        for name, place in list(self._goals.items()):
            goal = self._plan.places[place]
            if road.vehicle(name) is None:
                del self._goals[name]
                continue
            edge, pos, _ = road.road_place(name)
            # SUMO has the front of a vehicle, and a goal is reached by its centre.
            if edge == goal.edge and pos >= goal.pos + self._actors[name].length / 2.0:
                del self._goals[name]
                road.arrive(name)
                recorder.arrive(time, name)

    def new_goal(self, road: MovedActors, name: str, place: str, time: float) -> SavedWalk | None:
        """Lead an actor to a node; of a person, the walk there."""
        target = self._plan.places[place]
        actor = self._actors[name]
        if target.edge is None:
            self._report_failure(name, time, f"{place!r} is not on SUMO's network")
        elif actor.person:
            return SavedWalk((target.edge,), target.pos)
        elif road.lead_to(name, target.edge, through=True):
            self._goals[name] = place
        else:
            self._report_failure(name, time, f"no route leads from here to {place!r}")
        return None

    def state(self) -> dict[str, Any]:
        """What has to be remembered, for JSON."""
        return {
            "added": sorted(self._added),
            "dark": self._dark,
            "goals": self._goals,
            "faster": self._faster,
        }

    def restore(self, state: Mapping[str, Any]) -> None:
        """Inverse of :meth:`state`."""
        self._added, self._dark = set(state["added"]), dict(state["dark"])
        self._goals = dict(state["goals"])
        self._faster = dict(state["faster"])

    def _put_on_road(self, road: MovedActors, wanted_actor: WantedActor, time: float) -> None:
        held = self._plan.held.get(wanted_actor.actor)
        if held is None or wanted_actor.actor in self._added:
            self._report_failure(
                wanted_actor.actor, time, "it cannot appear: it has no route, or it was there"
            )
            return
        self._added.add(wanted_actor.actor)
        departs_at = road.insert(wanted_actor.actor, held, wanted_actor.speed)
        if departs_at is None:
            self._report_failure(wanted_actor.actor, time, "SUMO does not let it appear")
            return
        if not held.person:
            attributes = held.attributes
            begin = attributes["departSpeed"] if wanted_actor.speed is None else wanted_actor.speed
            if begin != "avg" and float(begin) > departs_at:
                self._faster[wanted_actor.actor] = float(begin)
        if wanted_actor.at is not None:
            x, y, hdg = wanted_actor.at
            ahead = self._actors[wanted_actor.actor].length / 2.0
            if not held.person and wanted_actor.actor in self._plan.by_story:
                # SUMO has it on the road a step later, by when it has driven on.
                own_speed = held.attributes["departSpeed"]
                speed = wanted_actor.speed
                if speed is None:
                    speed = 0.0 if own_speed == "avg" else float(own_speed)
                ahead += speed * self._step
            x += ahead * math.cos(hdg) + self._offset[0]
            y += ahead * math.sin(hdg) + self._offset[1]
            if not held.person and road.off_lanes(
                x, y, width=self._actors[wanted_actor.actor].width
            ):
                x, y = wanted_actor.at[:2]
                why = f"it appears where it is placed, as {x:g}, {y:g} is on no lane"
                self._report_failure(wanted_actor.actor, time, why)
                return
            put = road.put_person if held.person else road.put_vehicle
            put(wanted_actor.actor, x, y, float(angle_deg_from_hdg(hdg)))

    def _switch_light(self, road: MovedActors, wanted_signal: WantedSignal, time: float) -> None:
        light, link = self._plan.signals[wanted_signal.light, wanted_signal.movement or ""]
        if wanted_signal.shows == DARK:
            if light not in self._dark:
                self._dark[light] = road.program(light)
                road.run_program(light, DARK)
            return
        if light in self._dark:
            road.run_program(light, self._dark.pop(light))
        if wanted_signal.movement is not None and not road.jump_to_green(light, link):
            self._report_failure(
                wanted_signal.light,
                time,
                f"movement {wanted_signal.movement!r} has green in no stage",
            )

    def _report_failure(self, name: str, time: float, why: str) -> None:
        self.lost.append(Event(time, EventKind.RULE_FAILED, name, detail=why))
