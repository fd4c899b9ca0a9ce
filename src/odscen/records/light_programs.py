"""Programs that the lights of a run have: signal groups, stages and times, as they are run.

Kept in the run folder as ``signals.json``, so that logs, figures and drawings name signal groups
without asking SUMO.
"""

from __future__ import annotations

import json
from dataclasses import dataclass, fields
from functools import lru_cache
from itertools import pairwise
from math import dist
from typing import NamedTuple

from odscen.base.stored_files import stored_document

_FORMAT = "odscen-signals"
_VERSION = 1


class ProgramPhase(NamedTuple):
    """Seconds for which a state is shown; ``stage`` is the id of the stage whose green it is."""

    seconds: float
    state: str
    name: str
    stage: str = ""
    least: float = 0.0
    most: float = 0.0
    on_call: bool = False


@dataclass(frozen=True, slots=True)
class ShownGroup:
    """A signal group: its letters in the states, and what it is for.

    ``lanes`` are SUMO's: for each link that before the light, then those inside the junction; of
    crossings none. ``paths`` are points of each link's way, x and y in metres.
    """

    id: str
    links: tuple[int, ...]
    movements: tuple[str, ...]
    walk: bool
    lanes: tuple[tuple[str, ...], ...] = ()
    paths: tuple[tuple[tuple[float, float], ...], ...] = ()


@dataclass(frozen=True, slots=True)
class ShownPlan:
    """One program: ``begins`` are the seconds of the run at which it is to take over."""

    id: str
    offset: float
    phases: tuple[ProgramPhase, ...]
    begins: tuple[float, ...] = ()

    @property
    def cycle(self) -> float:
        """Seconds of all phases."""
        return sum(phase.seconds for phase in self.phases)


@dataclass(frozen=True, slots=True)
class ShownDetector:
    """A detector, and the stages that it prolongs; ``call`` if it calls them instead.

    ``bus`` if it is an area that sees buses only, which have priority for the stages. ``place`` are
    points along it in driving direction, x and y in metres: its rear and front end, or where people
    wait. ``ahead`` are metres from its front end to the stop line, ``gap`` the seconds between
    vehicles in which a stage goes on.
    """

    id: str
    name: str
    stages: tuple[str, ...]
    call: bool = False
    place: tuple[tuple[float, float], ...] = ()
    ahead: float = 0.0
    gap: float = 0.0
    bus: bool = False

    @property
    def length(self) -> float:
        """Metres along it."""
        return sum(dist(a, b) for a, b in pairwise(self.place))


@dataclass(frozen=True, slots=True)
class LightProgram:
    """All that one light is told to show.

    ``id`` is SUMO's; ``junctions`` are the names that scenarios have for it; ``own`` says whether
    the program is the scenario's.
    """

    id: str
    junctions: tuple[str, ...]
    control: str
    own: bool
    groups: tuple[ShownGroup, ...]
    plans: tuple[ShownPlan, ...]
    detectors: tuple[ShownDetector, ...] = ()


class StageSpan(NamedTuple):
    """A stage in the cycle of a plan; seconds.

    ``begin`` and ``end`` are those of its green, and ``split`` lasts until the next stage begins.
    ``seconds`` are planned, ``least`` and ``most`` those of a green that may vary, else 0.
    """

    id: str
    begin: float
    end: float
    split: float
    least: float
    most: float
    on_call: bool
    state: str

    @property
    def seconds(self) -> float:
        """Of green."""
        return self.end - self.begin

    def groups(self, light: LightProgram, letters: str = "Gg") -> tuple[str, ...]:
        """Ids of the groups with a movement that shows one of these letters."""
        return tuple(
            group.id
            for group in light.groups
            if any(self.state[link] in letters for link in group.links)
        )


def stage_spans(plan: ShownPlan) -> tuple[StageSpan, ...]:
    """Stages of a plan in order, once each; their splits add up to the cycle."""
    spans: list[StageSpan] = []
    now, last = 0.0, ""
    for phase in plan.phases:
        begin, now = now, now + phase.seconds
        if not phase.stage:
            last = ""
            continue
        if phase.stage == last:
            span = spans[-1]
            held = span.seconds if phase.most > phase.least else 0.0
            spans[-1] = span._replace(end=now, least=held + phase.least, most=held + phase.most)
            continue
        last = phase.stage
        spans.append(
            StageSpan(
                phase.stage, begin, now, 0.0, phase.least, phase.most, phase.on_call, phase.state
            )
        )
    begins = [span.begin for span in spans[1:]] + [plan.cycle + span.begin for span in spans[:1]]
    return tuple(
        span._replace(split=following - span.begin)
        for span, following in zip(spans, begins, strict=True)
    )


def programs_to_json(programs: tuple[LightProgram, ...]) -> str:
    """One JSON document."""
    data = {"format": _FORMAT, "version": _VERSION, "lights": programs}
    return json.dumps(data, default=_shallow_fields, separators=(",", ":"), allow_nan=False)


def _shallow_fields(
    light_program: LightProgram | ShownGroup | ShownPlan | ShownDetector,
) -> dict[str, object]:
    """What ``asdict`` gives, one level; it would copy each text."""
    return {field.name: getattr(light_program, field.name) for field in fields(light_program)}


@lru_cache(maxsize=8)
def programs_from_json(text: str) -> tuple[LightProgram, ...]:
    """Inverse of :func:`programs_to_json`.

    Raises
    ------
    InputError
        If it is not such a document of this version.
    """
    with stored_document(
        text, form=_FORMAT, version=_VERSION, what="the programs of lights"
    ) as data:
        return tuple(_read_light(light) for light in data["lights"])


def _read_light(data: dict[str, object]) -> LightProgram:
    light = json.loads(json.dumps(data), object_hook=_lists_to_tuples)
    groups = tuple(ShownGroup(**group) for group in light.pop("groups"))
    plans = tuple(
        ShownPlan(**{**plan, "phases": tuple(ProgramPhase(*part) for part in plan["phases"])})
        for plan in light.pop("plans")
    )
    detectors = tuple(ShownDetector(**part) for part in light.pop("detectors"))
    return LightProgram(**light, groups=groups, plans=plans, detectors=detectors)


def _lists_to_tuples(data: dict[str, object]) -> dict[str, object]:
    def made(value: object) -> object:
        return tuple(map(made, value)) if isinstance(value, list) else value

    return {key: made(value) for key, value in data.items()}
