"""Signal programs: what must not meet never has green together, each gets it in time."""

from __future__ import annotations

from itertools import combinations, groupby, pairwise
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from odscen.convert.model.conversion_report import ElementOutcome
from odscen.convert.model.net import STAGE, Phase
from odscen.convert.signals.signal_programs import (
    FLOW_RATIO,
    GroupConflicts,
    SignalGroup,
    plan_stages,
    program,
)
from odscen.convert.verify.fidelity import unsafe_pairs
from odscen.convert.verify.net_reader import read_net
from odscen.opendrive.objects import signal_kind
from tests.convert.maps import converted, each_map, named

GOING = frozenset("Ggy")
Junction = tuple[list[SignalGroup], GroupConflicts]


def car(link: int, *, speed: float = 13.89, controller: str = "") -> SignalGroup:
    return SignalGroup((link,), controller, walkers=False, speed=speed)


def walk(link: int) -> SignalGroup:
    return SignalGroup((link,), "", walkers=True, speed=0.0)


def apart(*pairs: tuple[int, int]) -> GroupConflicts:
    return GroupConflicts(frozenset(pairs))


def phases_of(groups: list[SignalGroup], conflicts: GroupConflicts) -> tuple[Phase, ...]:
    return program(plan_stages(groups, conflicts), len(groups))


@st.composite
def junctions(draw: st.DrawFn) -> Junction:
    """Groups of one link each, vehicles first, and which of them meet; crossings never do."""
    cars = draw(st.integers(1, 7))
    walks = draw(st.integers(0, 4))
    groups = [
        car(
            n,
            speed=draw(st.sampled_from([5.0, 8.33, 13.89, 16.67, 19.44, 27.78])),
            controller=draw(st.sampled_from(["", "a", "b"])),
        )
        for n in range(cars)
    ]
    groups += [walk(cars + n) for n in range(walks)]
    pairs = [(i, j) for i, j in combinations(range(cars + walks), 2) if i < cars]
    if not pairs:
        return groups, GroupConflicts()
    never = draw(st.frozensets(st.sampled_from(pairs)))
    clearing = {
        pair: float(draw(st.integers(1, 6) if pair[0] < cars else st.integers(3, 20)))
        for i, j in sorted(never)
        for pair in ((i, j), (j, i))
    }
    yielding = draw(st.frozensets(st.sampled_from(pairs)))
    return groups, GroupConflicts(never, yielding - never, clearing)


def letters(phases: tuple[Phase, ...], link: int) -> list[str]:
    """State of a link second by second, twice round."""
    once = [phase.state[link] for phase in phases for _ in range(round(phase.duration))]
    return once + once


def gaps(first: list[str], second: list[str]) -> list[int]:
    """Seconds between each end of one link's green and the next green of another."""
    found = []
    for now, (one, next_) in enumerate(pairwise(first)):
        if one in "Gg" and next_ not in "Gg":
            onwards = "".join(second[now + 1 :]).upper()
            if "G" in onwards:
                found.append(onwards.index("G"))
    return found


@pytest.mark.slow
@given(junctions())
def test_no_two_that_are_kept_apart_may_go_at_a_time(junction: Junction) -> None:
    groups, conflicts = junction
    for phase in phases_of(groups, conflicts):
        for i, j in conflicts.apart:
            assert not {phase.state[i], phase.state[j]} <= GOING


@pytest.mark.slow
@given(junctions())
def test_who_gives_way_to_another_that_is_green_has_the_green_that_does(
    junction: Junction,
) -> None:
    groups, conflicts = junction
    for phase in phases_of(groups, conflicts):
        for waits, goes in conflicts.yielding:
            if phase.state[goes] in "Gg":
                assert phase.state[waits] != "G"
        for link, letter in enumerate(phase.state):
            assert letter != "g" or any(pair[0] == link for pair in conflicts.yielding)


@pytest.mark.slow
@given(junctions())
def test_every_group_has_green_and_red_unless_it_meets_no_other(
    junction: Junction,
) -> None:
    groups, conflicts = junction
    phases = phases_of(groups, conflicts)
    for link in range(len(groups)):
        shown = letters(phases, link)
        assert set(shown) & set("Gg")
        assert "r" in shown or not any(link in pair for pair in conflicts.apart)


@pytest.mark.slow
@given(junctions())
def test_phases_last_and_fit_their_links(junction: Junction) -> None:
    groups, conflicts = junction
    for phase in phases_of(groups, conflicts):
        assert phase.duration >= 1.0
        assert phase.duration == round(phase.duration), "whole seconds"
        assert len(phase.state) == len(groups)
        assert set(phase.state) <= set("Ggyr")


@pytest.mark.slow
@given(junctions())
def test_between_two_greens_the_junction_is_cleared(junction: Junction) -> None:
    groups, conflicts = junction
    phases = phases_of(groups, conflicts)
    for i, j in conflicts.apart:
        for ending, beginning in ((i, j), (j, i)):
            needed = groups[ending].yellow + conflicts.seconds(ending, beginning)
            for gap in gaps(letters(phases, ending), letters(phases, beginning)):
                assert gap >= needed


@pytest.mark.slow
@given(junctions())
def test_yellow_follows_green_and_lasts_as_long_as_it_should(
    junction: Junction,
) -> None:
    groups, conflicts = junction
    phases = phases_of(groups, conflicts)
    for link, group in enumerate(groups):
        shown = letters(phases, link)
        shown = ["G" if sign == "g" else sign for sign in shown]
        runs = [(sign, len(list(run))) for sign, run in groupby(shown)]
        for (before, _), (sign, seconds), (after, _) in zip(runs, runs[1:], runs[2:], strict=False):
            if sign == "y":
                assert (before, after) == ("G", "r")
                assert seconds >= group.yellow
            if sign == "G":
                assert after == ("r" if group.walkers else "y")


@pytest.mark.parametrize(
    ("kmh", "seconds"), [(30, 3.0), (50, 3.0), (60, 4.0), (70, 5.0), (100, 5.0)]
)
def test_yellow_grows_with_the_limit(kmh: float, seconds: float) -> None:
    assert car(0, speed=kmh / 3.6).yellow == seconds
    phases = phases_of([car(0, speed=kmh / 3.6), car(1, speed=5.0)], apart((0, 1)))
    assert [p.duration for p in phases if p.state == "yr"] == [seconds]


def test_crossings_clear_while_the_vehicles_of_their_stage_go_on() -> None:
    conflicts = GroupConflicts(
        frozenset({(0, 1), (1, 2)}), clearing={(2, 1): 12.0, (0, 1): 2.0, (1, 0): 2.0, (1, 2): 2.0}
    )
    phases = phases_of([car(0), car(1), walk(2)], conflicts)
    clear = [phase for phase in phases if phase.name == "pedestrian clearance"]
    assert [(phase.state, phase.duration) for phase in clear] == [("Grr", 12.0 - 3.0 - 2.0)]


def test_vehicles_begin_before_the_crossings_for_which_more_has_to_be_clear() -> None:
    conflicts = GroupConflicts(
        frozenset({(0, 1), (0, 2)}),
        clearing={(0, 1): 2.0, (1, 0): 2.0, (0, 2): 6.0, (2, 0): 9.0},
    )
    phases = phases_of([car(0), car(1), walk(2)], conflicts)
    start = next(n for n, phase in enumerate(phases) if phase.state == "yrr")
    shown = [(p.name, p.state, p.duration) for p in phases[start : start + 3]]
    assert shown == [
        ("yellow", "yrr", 3.0),
        ("all red", "rrr", 2.0),
        ("vehicles first", "rGr", 4.0),
    ]


def test_who_does_not_meet_goes_together() -> None:
    groups = [car(0), car(1), car(2), car(3)]
    across = apart((0, 1), (0, 3), (1, 2), (2, 3))
    assert plan_stages(groups, across).green == (frozenset({0, 2}), frozenset({1, 3}))


def test_what_one_controller_switches_goes_together_if_it_can() -> None:
    groups = [car(0, controller="a"), car(1), car(2, controller="a")]
    assert plan_stages(groups, apart((0, 1), (1, 2))).green[0] == {0, 2}
    assert not any({0, 2} <= stage for stage in plan_stages(groups, apart((0, 2))).green)


def test_a_light_that_has_nothing_to_take_turns_with_still_turns_red() -> None:
    phases = phases_of([car(0)], apart())
    assert {phase.state for phase in phases} == {"G", "y", "r"}


def test_two_stages_share_a_cycle_as_webster_has_it() -> None:
    conflicts = GroupConflicts(frozenset({(0, 1)}), clearing={(0, 1): 5.0, (1, 0): 5.0})
    phases = phases_of([car(0), car(1)], conflicts)
    lost = 2 * (3.0 + 5.0)
    webster = (1.5 * lost + 5.0) / (1.0 - FLOW_RATIO)
    assert sum(phase.duration for phase in phases) == pytest.approx(webster, abs=1.0)


@pytest.mark.slow
def test_a_crossing_of_two_roads_has_two_stages_with_turns_that_give_way() -> None:
    net = read_net(converted(named("signal_crossing")).network.net_xml)
    (light,) = converted(named("signal_crossing")).xml.findall("tlLogic")
    stages = [p.get("state", "") for p in light if p.get("name", "").startswith(STAGE)]
    assert len(stages) == 2
    assert sum(float(p.get("duration", 0)) for p in light.findall("phase")) < 90.0
    rows = net.request_rows()["J10001"]
    crossings = [link.link_index for link in rows if link.via == ""]
    assert all(any(stage[n] == "G" for stage in stages) for n in crossings), "walk in parallel"


LIGHTS = {
    "carla-2020/Town01": 12,
    "carla-2020/Town04": 12,
    "carla-2020/Town07": 5,
    "esmini/fabriksgatan_traffic_lights": 1,
    "signal_crossing": 1,
    "t_junction_signs": 0,
    "roundabout": 0,
}


@pytest.mark.slow
@pytest.mark.parametrize("name", LIGHTS)
def test_the_lights_of_the_map_are_those_of_the_network(name: str) -> None:
    assert len(converted(named(name)).xml.findall("tlLogic")) == LIGHTS[name]


@pytest.mark.slow
@each_map()
def test_on_no_map_have_two_that_meet_green_together_unless_one_gives_way(path: Path) -> None:
    net = read_net(converted(path).network.net_xml)
    assert unsafe_pairs(net) == ()


@pytest.mark.slow
@each_map()
def test_on_no_map_has_traffic_from_across_green_together(path: Path) -> None:
    """Giving way does not make it right: a crossing road, or a crossing before the turn, waits."""
    made = converted(path)
    net = read_net(made.network.net_xml)
    straight = {
        (link.get("tl"), int(link.get("linkIndex", -1)))
        for link in made.xml.iterfind("connection")
        if link.get("dir") == "s" and link.get("tl")
    }
    programs = {program.tl: program.states for program in net.programs}
    for junction in net.junctions:
        links = net.request_rows()[junction.id]
        for one, foes in junction.foes.items():
            for other in foes:
                pair = (links[one], links[other])
                ways = [(link.tl, link.link_index) in straight or not link.via for link in pair]
                if all(link.tl for link in pair) and all(ways):
                    for state in programs[pair[0].tl]:
                        assert not {state[link.link_index] for link in pair} <= GOING, pair


@each_map()
def test_every_link_at_a_light_has_green_sometime_and_red_sometime(path: Path) -> None:
    net = read_net(converted(path).network.net_xml)
    programs = {program.tl: program.states for program in net.programs}
    lit: dict[str, set[int]] = {name: set() for name in programs}
    for link in net.links:
        if not link.tl:
            continue
        lit[link.tl].add(link.link_index)
        shown = {state[link.link_index] for state in programs[link.tl]}
        assert shown & {"G", "g"}, link
        assert "r" in shown, link
    for name, states in programs.items():
        assert lit[name] == set(range(len(states[0]))), "a letter for each link and no more"


@each_map()
def test_every_light_of_the_map_is_behind_a_link_or_reported_lost(path: Path) -> None:
    made = converted(path)
    kinds = {
        signal.id: signal_kind(signal)
        for road in made.odr.roads.values()
        for signal in road.signals
    }
    lights = {number for number, kind in kinds.items() if kind == "traffic_light"}
    report = made.network.report.entries
    lost = {
        e.element.rsplit(" ", 1)[1]
        for e in report
        if e.outcome is ElementOutcome.LOST and "> sig" in e[1]
    }
    params = made.xml.iterfind("tlLogic/param")
    values = [e.get("value") for e in params if e.get("key").startswith("linkSignalID:")]
    acting = {signal for value in values for signal in value.split()}
    walkers = {number for number in acting if kinds[number] == "pedestrian_light"}
    assert acting - walkers == lights - lost
