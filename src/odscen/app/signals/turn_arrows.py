"""Protected-permissive turns where the demand of a scenario asks for them.

A turn across oncoming traffic goes through gaps as long as these do. Where left and opposing volume
are many, it gets a stage of its own as well: when the product of both exceeds what the HCM names
(Highway Capacity Manual, planning-level check of left-turn treatment). Turns that share their lane
keep to gaps, since who waits for an arrow would stop those behind; turns that are protected only
stay so.

The arrow lags, and opposing turns have theirs together. There is no yellow trap: the stage of the
arrow has turns only, so nobody who turns through gaps sees yellow while oncoming traffic goes on.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from odscen.app.maps import map_of
from odscen.app.scenarios import given_scenario
from odscen.app.signals.program_editing import take_over_program
from odscen.app.signals.signal_optimisation import (
    chosen_lights,
    coming_vehicles,
    refuse_interval,
)
from odscen.convert.model.net import CROSSED
from odscen.convert.signals.shared_green import MOST_STAGES
from odscen.scenario.checks.signal_checks import signal_problems
from odscen.scenario.document.problems import refuse_errors
from odscen.scenario.edits.edit_registry import changed_part
from odscen.scenario.edits.turn_treatment import crossing_turns, with_turn
from odscen.scenario.signals.program_design import DesignedProgram
from odscen.sumo.calibrate.light_timing import timing_of, with_timings
from odscen.sumo.calibrate.turning_volumes import (
    DRIVEN,
    turning_volumes,
    turns_of,
)

if TYPE_CHECKING:
    from collections.abc import Collection, Sequence
    from collections.abc import Set as AbstractSet

    from odscen.base.given_files import GivenPath
    from odscen.maps.store import Workspace
    from odscen.scenario.document.scenario_document import Scenario
    from odscen.scenario.document.signals_document import JunctionTiming
    from odscen.scenario.edits.turn_treatment import CrossingTurn
    from odscen.scenario.signals.light import Light

_Counts = list[tuple[frozenset[int], float]]
"""Movements of each turn, one for each of its lanes, and its vehicles an hour."""

PRODUCTS = {1: 50_000.0, 2: 90_000.0, 3: 110_000.0}
"""Turning times opposing vehicles (each an hour) by opposing lanes, from which on a turn is
protected (HCM 2000, chapter 10; HCM 7th edition, chapter 31); three stand for more, too."""


class TurnArrow(NamedTuple):
    """A turn that got a protected stage beside its permissive one.

    Attributes
    ----------
    junction, approach, turn
        Which it is; ``turn`` is ``left``, or ``right`` where traffic keeps left.
    vehicles, opposing
        Vehicles an hour that turn, and that they give way to.
    lanes
        Opposing lanes.
    """

    junction: str
    approach: str
    turn: str
    vehicles: float
    opposing: float
    lanes: int

    @property
    def product_reached(self) -> bool:
        """Whether the volumes ask for an arrow."""
        return self.vehicles * self.opposing > PRODUCTS[min(max(self.lanes, 1), 3)]

    def to_words(self) -> str:
        """What it has got, as a sentence."""
        return (
            f"Junction {self.junction}: the {self.turn} turn from {self.approach} has got an arrow "
            f"({self.vehicles:.0f} vehicles an hour across {self.opposing:.0f})."
        )


def arrow_words(arrows: Sequence[TurnArrow]) -> tuple[str, ...]:
    """Say of each turn that it has got an arrow, or that none has."""
    none = "No turn has got an arrow: none that needs one has a lane for itself and a stage left."
    return tuple(arrow.to_words() for arrow in arrows) or (none,)


def with_turn_arrows(
    workspace: Workspace,
    scenario: Scenario | GivenPath,
    *,
    junctions: Sequence[str] = (),
    begin: float | None = None,
    end: float | None = None,
) -> tuple[Scenario, tuple[TurnArrow, ...]]:
    """Give turns at lights an arrow as well where the volumes of the scenario ask for one.

    A light that keeps the map's program gets it as one of the scenario's own first. New stages
    have 6 s of green; with actuated control they come on call.

    Parameters
    ----------
    junctions
        Lights; all if empty.
    begin, end
        Seconds of the scenario whose demand it is; the busiest hour if not given.

    Raises
    ------
    InputError
        If the map has no light, or the interval is none of the scenario.
    NotFoundError
        If a junction has no light.
    ScenarioError
        With every problem of the signals or of the demand.
    """
    scenario = given_scenario(scenario)
    loaded = map_of(workspace, scenario)
    refuse_interval(scenario, begin, end)
    lights = chosen_lights(loaded, junctions)
    refuse_errors(signal_problems(scenario.signals, loaded.lights))
    vehicles = coming_vehicles(workspace, scenario)
    duration = scenario.simulation.duration
    volumes = turning_volumes(vehicles, duration=duration, begin=begin, end=end).by_turn
    net = loaded.sumo.net
    arrows: list[TurnArrow] = []
    for number in lights:
        view = loaded.lights[number]
        counts = [
            (frozenset(links), volumes[turn].vehicles)
            for turn, links in turns_of(loaded.sumo.lights[number], loaded.sumo).items()
            if turn in volumes
        ]
        driven = {
            n
            for n, link in enumerate(loaded.sumo.lights[number].links)
            if link.turn != CROSSED and net.lanes[link.source].allows(DRIVEN)
        }
        asked = _find_wanted_arrows(
            view, counts, driven, across="right" if net.lefthand else "left"
        )
        if not asked:
            continue
        own = timing_of(scenario, view.names)
        changed = scenario
        if own is None or not own.stages:
            changed = take_over_program(workspace, scenario, view.names[0])
        timing = timing_of(changed, view.names)
        assert timing is not None  # it was taken over
        control = scenario.signals.control_of(timing)
        given = _place_arrows(timing, view, asked, on_call=control == "actuated")
        if given is not None:
            scenario = with_timings(changed, [given[0]])
            arrows += given[1]
    return scenario, tuple(arrows)


def _place_arrows(
    timing: JunctionTiming, view: Light, asked: Sequence[TurnArrow], *, on_call: bool
) -> tuple[JunctionTiming, list[TurnArrow]] | None:
    """The timing with arrows in at most four stages, and the turns that have got one."""
    found, had = [], {stage.id for stage in timing.stages}
    for arrow in asked:
        if _has_protected_stage(timing, view, arrow):
            continue
        new = with_turn(
            timing, view, approach=arrow.approach, turn=arrow.turn, treatment="both"
        )  # fmt: skip
        if len(new.stages) <= MOST_STAGES:
            timing = new
            found.append(arrow)
    if not found:
        return None
    stages = tuple(
        changed_part(stage, {"on_call": True}) if on_call and stage.id not in had else stage
        for stage in timing.stages
    )
    return changed_part(timing, {"stages": stages}), found


def _has_protected_stage(timing: JunctionTiming, view: Light, arrow: TurnArrow) -> bool:
    """Whether a turn has a stage without giving way already."""
    own = next(t for t in crossing_turns(view) if (t.approach, t.turn) == arrow[1:3])
    program = DesignedProgram(timing, view, "fixed")
    groups = {program.group_of[n] for n in own.movements}
    return any(groups & set(stage.protected) for stage in timing.stages)


def _find_wanted_arrows(
    view: Light, counts: _Counts, driven: AbstractSet[int], *, across: str
) -> list[TurnArrow]:
    """Turns whose volumes ask for an arrow, and their opposites that can share it."""
    turns = {t.approach: t for t in crossing_turns(view) if t.turn == across and t.alone}
    loads = {name: _load_of_turn(view, turn, counts, driven) for name, turn in turns.items()}
    asked = {name for name, (load, _) in loads.items() if load.product_reached}
    for name in sorted(asked):
        opposite = loads[name][1]
        if opposite in turns and not _turns_meet(view, turns[name], turns[opposite]):
            asked.add(opposite)
    return [loads[name][0] for name in turns if name in asked]


def _count_vehicles(counts: _Counts, movements: Collection[int]) -> float:
    """All vehicles of the turns that have one of these movements, whichever lane they take."""
    return sum(vehicles for links, vehicles in counts if not links.isdisjoint(movements))


def _turns_meet(view: Light, one: CrossingTurn, other: CrossingTurn) -> bool:
    return any((min(i, j), max(i, j)) in view.met for i in one.movements for j in other.movements)


def _load_of_turn(
    view: Light, turn: CrossingTurn, counts: _Counts, driven: AbstractSet[int]
) -> tuple[TurnArrow, str]:
    """What a turn has to find gaps for, and the approach from which most lanes of it come."""
    before = {
        n
        for meeting in view.meetings
        if meeting.yields in turn.movements and meeting.shares
        for n in (meeting.one, meeting.other)
        if view.movements[n].drive and view.movements[n].approach != turn.approach
    }
    straight = [n for n in sorted(before) if view.movements[n].turn == "straight"]
    lanes = {view.movements[n].lanes[0] for n in straight if n in driven}
    approaches = [view.movements[n].approach for n in straight]
    opposite = max(dict.fromkeys(approaches), key=approaches.count, default="")
    arrow = TurnArrow(
        view.names[0], turn.approach, turn.turn,
        _count_vehicles(counts, turn.movements), _count_vehicles(counts, before), len(lanes),
    )  # fmt: skip
    return arrow, opposite
