"""Signal programs: movements that meet never have green together, each gets it in time."""

from __future__ import annotations

from itertools import combinations, groupby, pairwise
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from odscen.convert.model.conversion_report import ElementOutcome
from odscen.convert.model.net import Phase
from odscen.convert.signals.signal_programs import SignalGroup, plan_stages, program
from odscen.convert.verify.net_reader import read_net
from odscen.opendrive.objects import signal_kind
from tests.convert.maps import converted, each_map, named

GOING = frozenset("Ggy")
Foes = frozenset[tuple[int, int]]


def car(
    link: int, *, speed: float = 13.89, path: float = 20.0, controller: str = ""
) -> SignalGroup:
    return SignalGroup((link,), controller, walkers=False, speed=speed, path=path)


def walk(link: int, *, path: float = 12.0) -> SignalGroup:
    return SignalGroup((link,), "", walkers=True, speed=0.0, path=path)


def phases_of(groups: list[SignalGroup], foes: Foes) -> tuple[Phase, ...]:
    return program(plan_stages(groups, foes), len(groups))


@st.composite
def junctions(draw: st.DrawFn) -> tuple[list[SignalGroup], Foes]:
    """Groups of one link each, vehicles first, and which of them meet; crossings never do."""
    cars = draw(st.integers(1, 7))
    walks = draw(st.integers(0, 4))
    groups = [
        car(
            n,
            speed=draw(st.sampled_from([5.0, 8.33, 13.89, 16.67, 19.44, 27.78])),
            path=draw(st.floats(5.0, 60.0)),
            controller=draw(st.sampled_from(["", "a", "b"])),
        )
        for n in range(cars)
    ]
    groups += [walk(cars + n, path=draw(st.floats(3.0, 25.0))) for n in range(walks)]
    pairs = [(i, j) for i, j in combinations(range(cars + walks), 2) if i < cars]
    return groups, draw(st.frozensets(st.sampled_from(pairs))) if pairs else frozenset()


def letters(phases: tuple[Phase, ...], link: int) -> list[str]:
    """State of a link second by second, twice round."""
    once = [phase.state[link] for phase in phases for _ in range(round(phase.duration))]
    return once + once


def gaps(first: list[str], second: list[str]) -> list[int]:
    """Seconds between each end of one link's green and the next green of another."""
    found = []
    for now, (one, next_) in enumerate(pairwise(first)):
        if one in "Gg" and next_ not in "Gg":
            onwards = second[now + 1 :]
            if "G" in onwards:
                found.append(onwards.index("G"))
    return found


@given(junctions())
def test_no_two_that_meet_may_go_at_a_time(junction: tuple[list[SignalGroup], Foes]) -> None:
    groups, foes = junction
    for phase in phases_of(groups, foes):
        for i, j in foes:
            assert not {phase.state[i], phase.state[j]} <= GOING


@given(junctions())
def test_every_group_has_green_and_red_unless_it_meets_no_other(
    junction: tuple[list[SignalGroup], Foes],
) -> None:
    groups, foes = junction
    phases = phases_of(groups, foes)
    for link in range(len(groups)):
        shown = letters(phases, link)
        assert "G" in shown
        assert "r" in shown or not any(link in pair for pair in foes)


@given(junctions())
def test_phases_last_and_fit_their_links(junction: tuple[list[SignalGroup], Foes]) -> None:
    groups, foes = junction
    for phase in phases_of(groups, foes):
        assert phase.duration >= 1.0
        assert phase.duration == round(phase.duration), "whole seconds"
        assert len(phase.state) == len(groups)
        assert set(phase.state) <= set("Gyr")


@given(junctions())
def test_between_two_greens_the_junction_is_cleared(
    junction: tuple[list[SignalGroup], Foes],
) -> None:
    groups, foes = junction
    phases = phases_of(groups, foes)
    for i, j in foes:
        for ending, beginning in ((i, j), (j, i)):
            group = groups[ending]
            for gap in gaps(letters(phases, ending), letters(phases, beginning)):
                assert gap >= cleared_after(group)


def cleared_after(group: SignalGroup) -> float:
    """Seconds after green until the last one has left; the others need one of them to start."""
    if group.walkers:
        return group.path / 1.2
    seconds = (group.path + 6.0) / min(group.speed, 14.0) - 1.0
    return group.yellow + min(max(seconds, 1.0), 8.0)


@given(junctions())
def test_yellow_follows_green_and_lasts_as_long_as_it_should(
    junction: tuple[list[SignalGroup], Foes],
) -> None:
    groups, foes = junction
    phases = phases_of(groups, foes)
    for link, group in enumerate(groups):
        shown = letters(phases, link)
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
    phases = phases_of([car(0, speed=kmh / 3.6), car(1, speed=5.0)], frozenset({(0, 1)}))
    assert [p.duration for p in phases if p.state == "yr"] == [seconds]


def test_persons_who_started_last_get_over_the_road() -> None:
    phases = phases_of([car(0), walk(1, path=12.0)], frozenset({(0, 1)}))
    assert min(gaps(letters(phases, 1), letters(phases, 0))) >= 10, "12 m at 1.2 m/s"


def test_who_does_not_meet_goes_together() -> None:
    groups = [car(0), car(1), car(2), car(3)]
    across = frozenset({(0, 1), (0, 3), (1, 2), (2, 3)})
    stages = plan_stages(groups, across).green
    assert stages == (frozenset({0, 2}), frozenset({1, 3}))


def test_what_one_controller_switches_goes_together_if_it_can() -> None:
    groups = [car(0, controller="a"), car(1), car(2, controller="a")]
    assert plan_stages(groups, frozenset({(0, 1), (1, 2)})).green[0] == {0, 2}
    apart = plan_stages(groups, frozenset({(0, 2)})).green
    assert not any({0, 2} <= stage for stage in apart)


def test_a_light_that_has_nothing_to_take_turns_with_still_turns_red() -> None:
    phases = phases_of([car(0)], frozenset())
    assert {phase.state for phase in phases} == {"G", "y", "r"}


LIGHTS = {
    "carla-2020/Town01": 12,
    "carla-2020/Town04": 12,
    "carla-2020/Town07": 5,
    "esmini/fabriksgatan_traffic_lights": 1,
    "signal_crossing": 1,
    "t_junction_signs": 0,
    "roundabout": 0,
}


@pytest.mark.parametrize("name", LIGHTS)
def test_the_lights_of_the_map_are_those_of_the_network(name: str) -> None:
    assert len(converted(named(name)).xml.findall("tlLogic")) == LIGHTS[name]


@each_map()
def test_on_no_map_have_two_that_meet_green_together(path: Path) -> None:
    net = read_net(converted(path).network.net_xml)
    programs = {program.tl: program.states for program in net.programs}
    rows = net.request_rows()
    for junction in net.junctions:
        links = rows[junction.id]
        assert len(junction.foes) == len(links)
        for one, foes in junction.foes.items():
            for other in foes:
                pair = (links[one], links[other])
                if not all(link.tl for link in pair):
                    continue
                for state in programs[pair[0].tl]:
                    shown = {state[link.link_index] for link in pair}
                    assert not shown <= GOING, (junction.id, pair)


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
        assert "G" in shown, link
        assert "r" in shown, link
    for name, states in programs.items():
        assert lit[name] == set(range(len(states[0]))), "a letter for each link and no more"


@each_map()
def test_every_light_of_the_map_is_behind_a_link_or_reported_lost(path: Path) -> None:
    made = converted(path)
    lights = {
        signal.id
        for road in made.odr.roads.values()
        for signal in road.signals
        if signal_kind(signal) == "traffic_light"
    }
    report = made.network.report.entries
    lost = {
        e.element.rsplit(" ", 1)[1]
        for e in report
        if e.outcome is ElementOutcome.LOST and "> sig" in e[1]
    }
    values = [entry.get("value") for entry in made.xml.iterfind("tlLogic/param")]
    assert {signal for value in values for signal in value.split()} == lights - lost
