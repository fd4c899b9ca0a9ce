"""Actions of rules as private and global actions."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

from odscen.formats.openscenario.dialect import xml
from odscen.formats.openscenario.xosc_lines import follow_line, path, replay, timed
from odscen.formats.openscenario.xosc_places import GroundPose
from odscen.formats.openscenario.xosc_presence import (
    BELOW,
    add_entity,
    delete_entity,
    private,
    speed_action,
)
from odscen.formats.openscenario.xosc_signals import (
    light_action,
    lights_action,
    signal_phase,
    signals_of,
)
from odscen.formats.openscenario.xosc_triggers import CannotSayError
from odscen.scenario.document.rules_document import USUAL_MOVE
from odscen.scenario.story.motion_laws import SHARPEST

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from lxml.etree import _Element

    from odscen.formats.base import ExportNotes
    from odscen.formats.openscenario.dialect import Dialect
    from odscen.formats.openscenario.xosc_places import Places
    from odscen.scenario.document.rules_document import StoryRule
    from odscen.scenario.document.scenario_document import Actor

_SHAPES: Final = {
    "step": "step",
    "linear": "linear",
    "cosine": "sinusoidal",
    "cubic": "cubic",
}
_RATE: Final = "ScenarioRunner takes the rate as seconds"
_WALKING: Final = 1.4
"""m/s of pedestrians whose speed is not given."""
_USUAL_SPEED: Final = 10.0
"""m/s of others."""
_SAME: Final = 0.05
"""Metres."""
_STILL: Final = 1e-6
"""m/s² below which nothing moves."""
IGNORES: Final = "left out, for only rules are obeyed there"
UNSAID_GOAL: Final = "a goal, for which ScenarioRunner refuses the whole file"


@dataclass(frozen=True, slots=True)
class Actions:
    """Makes actions; ``actors`` are those of the scenario by id, ``rules`` all of them."""

    places: Places
    dialect: Dialect
    notes: ExportNotes
    actors: Mapping[str, Actor]
    rules: Sequence[StoryRule] = ()

    def actions(self, kind: str, part: Any, actor: str, where: str) -> list[_Element]:
        """Contents of the actions that an action of a rule is in OpenSCENARIO.

        Raises
        ------
        CannotSayError
            If there is none.
        """
        make = _MAKERS.get(kind)
        if make is None:
            raise CannotSayError(f"OpenSCENARIO has no action {kind!r}")
        return make(self, part, actor, where)

    def trajectory(
        self, name: str, spots: Sequence[GroundPose], times: Sequence[float], *, timed: bool
    ) -> _Element:
        """``RoutingAction`` that leads along points; times are relative to its begin."""
        return follow_line(self.dialect, name, spots, times, clock="relative" if timed else None)

    def before(self, part: Any, actor: str) -> Iterator[Any]:
        """Yield actions of rules of an actor that stand before an action, in their order."""
        for rule in self.rules:
            for earlier in (part for item in rule.then for part in item.parts):
                if getattr(earlier, earlier.kind) is part:
                    return
                if rule.actor == actor:
                    yield earlier


def _write_speed(made: Actions, part: Any, _actor: str, where: str) -> list[_Element]:
    given = (("rate", part.rate), ("time", part.over), ("distance", part.within))
    dimension, value = next((pair for pair in given if pair[1] is not None), ("time", 0.0))
    if dimension == "rate" and made.dialect.for_scenario_runner:
        made.notes.approximated.append((where, _RATE))
    return [speed_action(part.to, _SHAPES[part.shape], dimension, value)]


def _write_brake(made: Actions, part: Any, _actor: str, where: str) -> list[_Element]:
    if part.hold is not None:
        made.notes.approximated.append((where, "what follows does not wait for the hold"))
    if made.dialect.for_scenario_runner:
        made.notes.approximated.append((where, _RATE))
    return [speed_action(0.0, "linear", "rate", part.by)]


def _write_stop(_made: Actions, part: Any, _actor: str, _where: str) -> list[_Element]:
    if part.within is None:
        return [speed_action(0.0, "step", "time", 0.0)]
    return [speed_action(0.0, "linear", "distance", part.within)]


def _controller_action(made: Actions, **axes: bool) -> _Element:
    action = xml("ActivateControllerAction", **axes)
    if made.dialect.minor == 0:
        return private(action)
    return private(xml("ControllerAction", action))


def _write_go(made: Actions, _part: Any, _actor: str, _where: str) -> list[_Element]:
    return [_controller_action(made, longitudinal=True)]


def _write_release(made: Actions, _part: Any, actor: str, _where: str) -> list[_Element]:
    known = made.actors.get(actor)
    by_sumo = known is None or known.driver == "sumo"
    return [_controller_action(made, lateral=by_sumo, longitudinal=by_sumo)]


def _write_drive(made: Actions, part: Any, _actor: str, _where: str) -> list[_Element]:
    by_sumo = part.by == "sumo"
    return [_controller_action(made, lateral=by_sumo, longitudinal=by_sumo)]


def _lane_change(part: Any, target: _Element, offset: float | None = None) -> _Element:
    given = (("rate", part.rate), ("distance", part.within), ("time", part.over or USUAL_MOVE))
    dimension, value = next(pair for pair in given if pair[1] is not None)
    dynamics = xml(
        "LaneChangeActionDynamics",
        dynamicsShape=_SHAPES[part.shape],
        dynamicsDimension=dimension,
        value=float(value),
    )
    change = xml(
        "LaneChangeAction", dynamics, xml("LaneChangeTarget", target), targetLaneOffset=offset
    )
    return private(xml("LateralAction", change))


def _write_lane(_made: Actions, part: Any, actor: str, _where: str) -> list[_Element]:
    if part.by is None:
        raise CannotSayError("a change to the lane that leads to a place")
    target = xml("RelativeTargetLane", entityRef=actor, value=int(part.by))
    return [_lane_change(part, target, float(part.offset) if part.offset else None)]


def _cut_in(made: Actions, part: Any, _actor: str, where: str) -> list[_Element]:
    if part.gap is not None:
        made.notes.approximated.append((where, "the gap in front of it is not reached by itself"))
    if made.dialect.for_scenario_runner:
        words = "ScenarioRunner counts lanes from the actor's own, and changes none"
        made.notes.approximated.append((where, words))
    return [_lane_change(part, xml("RelativeTargetLane", entityRef=part.to, value=0))]


def _write_offset(made: Actions, part: Any, actor: str, where: str) -> list[_Element]:
    asked = [
        earlier.offset.to for earlier in made.before(part, actor) if earlier.offset is not None
    ]
    moves = abs(part.to - (asked[-1] if asked else made.actors[actor].lateral_offset))
    timed = part.within is None and part.rate is None
    # Without a move no acceleration says how long it takes, and none does of a length or a rate.
    if not (moves and timed) and not made.dialect.for_scenario_runner:
        own = xml("RelativeTargetLane", entityRef=actor, value=0)
        return [_lane_change(part, own, float(part.to))]
    made.notes.approximated.append((where, "an offset has no duration but an acceleration"))
    seconds = part.over or USUAL_MOVE
    greatest = SHARPEST[part.shape] * moves / seconds**2
    dynamics = xml(
        "LaneOffsetActionDynamics",
        dynamicsShape=_SHAPES[part.shape],
        maxLateralAcc=greatest if greatest > _STILL else None,
    )
    target = xml("LaneOffsetTarget", xml("AbsoluteTargetLaneOffset", value=float(part.to)))
    return [
        private(xml("LateralAction", xml("LaneOffsetAction", dynamics, target, continuous=True)))
    ]


def _keep_gap(made: Actions, part: Any, _actor: str, where: str) -> list[_Element]:
    if part.seconds is not None and made.dialect.for_scenario_runner:
        raise CannotSayError("a gap in seconds, which ScenarioRunner refuses")
    about: dict[str, object] = {}
    if made.dialect.minor >= 1:
        side = "leading" if part.ahead else "trailing"
        about = {"coordinateSystem": "entity", "displacement": f"{side}ReferencedEntity"}
    elif part.ahead:
        made.notes.approximated.append((where, "1.0 does not say that the gap is ahead"))
    slowing = part.rate if part.braking is None else part.braking
    limits = xml("DynamicConstraints", maxAcceleration=part.rate, maxDeceleration=slowing,
                 maxSpeed=70.0)  # fmt: skip
    return [
        private(
            xml(
                "LongitudinalAction",
                xml(
                    "LongitudinalDistanceAction",
                    limits,
                    entityRef=part.to,
                    continuous=not part.once,
                    freespace=True,
                    distance=part.metres,
                    timeGap=part.seconds,
                    **about,
                ),
            )
        )
    ]


def _write_walk(made: Actions, part: Any, actor: str, where: str) -> list[_Element]:
    speed = part.speed or made.actors[actor].speed or _WALKING
    made.notes.approximated.append((where, "the walk begins where the walker is, not at a point"))
    spots = [made.places.spot(place) for place in (*part.through, part.to)]
    return [
        made.trajectory(f"{actor}: {where}", *timed(spots, speed), timed=len(spots) > 1),
        speed_action(speed, "step", "time", 0.0),
    ]


def _write_goal(made: Actions, part: Any, _actor: str, _where: str) -> list[_Element]:
    if made.dialect.for_scenario_runner:
        msg = UNSAID_GOAL
        raise CannotSayError(msg)
    return [acquire(made.places, part.to)]


def acquire(places: Places, node: str) -> _Element:
    """``PrivateAction`` that leads to a node."""
    return private(xml("RoutingAction", xml("AcquirePositionAction", places.goal(node))))


def _write_arrive(made: Actions, part: Any, actor: str, where: str) -> list[_Element]:
    master, own = (made.places.spot(place).element() for place in (part.when_at, part.at))
    master.tag, own.tag = "TargetPositionMaster", "TargetPosition"
    speed, steady = part.speed, None
    if made.dialect.for_scenario_runner and part.steady:
        made.notes.approximated.append((where, "only arrives at its speed in 1.0"))
    elif part.steady:
        steady = xml("TargetDistanceSteadyState", distance=part.steady)
    if made.dialect.for_scenario_runner and speed is None:  # which refuses one without
        speed = made.actors[actor].speed or made.actors[actor].initial_speed or _USUAL_SPEED
        made.notes.approximated.append((where, f"arrives at {speed:g} m/s"))
    final = None
    if speed is not None:
        final = xml("FinalSpeed", xml("AbsoluteSpeed", steady, value=float(speed)))
    return [private(xml("SynchronizeAction", master, own, final, masterEntityRef=part.to))]


def _write_ignore(made: Actions, _part: Any, _actor: str, where: str) -> list[_Element]:
    made.notes.approximated.append((where, IGNORES))
    return []


def _write_vanish(made: Actions, _part: Any, actor: str, where: str) -> list[_Element]:
    if made.dialect.for_scenario_runner:
        made.notes.approximated.append((where.partition(".")[0], BELOW))
    at = made.places.start(made.actors[actor])
    return [delete_entity(actor, at, made.dialect)]


def _write_appear(made: Actions, part: Any, actor: str, where: str) -> list[_Element]:
    if made.dialect.for_scenario_runner:
        made.notes.approximated.append((where.partition(".")[0], BELOW))
    own = made.actors[actor]
    start = spot = made.places.start(own)
    if part.at is not None:
        spot = GroundPose(part.at[0], part.at[1], start.z, part.at[2]).back(
            made.places.centre_ahead(own)
        )
        if math.hypot(spot.x - start.x, spot.y - start.y) < _SAME:
            made.notes.approximated.append((where, "it appears where it is placed"))
    speed = own.initial_speed if part.speed is None else part.speed
    there = add_entity(own.id, spot, made.dialect)
    return [there, speed_action(speed or 0.0, "step", "time", 0.0)]


_LIGHTS: Final = {
    "brake": "brakeLights",
    "front": "lowBeam",
    "high_beam": "highBeam",
    "fog": "fogLights",
    "emergency": "specialPurposeLights",
}
_INDICATORS: Final = {"left": "indicatorLeft", "right": "indicatorRight", "hazard": "warningLights"}


def _write_lights(made: Actions, part: Any, _actor: str, _where: str) -> list[_Element]:
    if made.dialect.minor < 3:  # the schema of 1.2 wants a light of the vehicle and one of the user
        raise CannotSayError("lights of vehicles, which can be written from 1.3 on")
    states = {name: "on" if getattr(part, field) else "off" for field, name in _LIGHTS.items()
              if getattr(part, field) is not None}  # fmt: skip
    if part.indicator is not None:
        states |= {
            name: "flashing" if side == part.indicator else "off"
            for side, name in _INDICATORS.items()
        }
    return [
        private(
            xml(
                "AppearanceAction",
                xml(
                    "LightStateAction",
                    xml("LightType", xml("VehicleLight", vehicleLightType=name)),
                    xml("LightState", mode=mode),
                    transitionTime=0.0,
                ),
            )
        )
        for name, mode in states.items()
    ]


def _write_signal(made: Actions, part: Any, _actor: str, _where: str) -> list[_Element]:
    source = made.places.source
    if made.dialect.for_scenario_runner:
        raise CannotSayError(
            "switching a traffic light, which ScenarioRunner refuses by the id of a signal"
        )
    if part.shows == "off" and (signals := signals_of(source, part.light)):
        return [light_action(signal, "off") for signal in signals]
    found = signal_phase(source, part.light, part.movement) if part.movement else None
    if found is None:
        raise CannotSayError(f"switching the light {part.light!r} to {part.shows}")
    controller, phase = found
    about = {"trafficSignalControllerRef": controller, "phase": phase}
    return [lights_action(xml("TrafficSignalControllerAction", **about))]


_MAKERS: Final[Mapping[str, Callable[[Actions, Any, str, str], list[_Element]]]] = {
    "speed": _write_speed,
    "brake": _write_brake,
    "stop": _write_stop,
    "go": _write_go,
    "lane": _write_lane,
    "cut_in": _cut_in,
    "offset": _write_offset,
    "keep_gap": _keep_gap,
    "walk": _write_walk,
    "path": path,
    "replay": replay,
    "goal": _write_goal,
    "arrive": _write_arrive,
    "appear": _write_appear,
    "vanish": _write_vanish,
    "lights": _write_lights,
    "release": _write_release,
    "drive": _write_drive,
    "ignore": _write_ignore,
    "signal": _write_signal,
}
