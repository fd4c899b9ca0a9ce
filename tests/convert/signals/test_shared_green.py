"""What may have green together at a light, given that one of both gives way."""

from __future__ import annotations

from odscen.convert.model.right_of_way import Movement, Rules, find_conflicts, requests
from odscen.convert.signals.shared_green import LightLinks, light_stages, link_conflicts
from tests.convert.turns import turn_left

NORTH = turn_left("s", "w", [(1.8, -12.0), (1.8, -6.0), (-1.0, 0.6), (-12.0, 1.8)])
BESIDE = turn_left("n", "e", [(-1.0, 12.0), (-1.0, 6.0), (1.0, -0.4), (12.0, -1.8)])
ACROSS = turn_left("n", "e", [(-1.8, 12.0), (-1.8, -1.0), (1.0, -3.0), (12.0, -4.0)])


def lit(*movements: Movement, waiting: tuple[int, ...] = ()) -> LightLinks:
    """A light, one signal for each movement; ``waiting`` wait inside the junction."""
    count = len(movements)
    conflicts = find_conflicts(movements, ())
    rights = requests(movements, conflicts, Rules(signalled=True))
    signals, empty = [(str(n),) for n in range(count)], [""] * count
    return LightLinks(
        movements, (), signals, empty, [False] * count, conflicts, rights, 1.0, frozenset(waiting)
    )


def test_turns_that_pass_too_near_beside_each_other_need_a_place_to_wait_for_green_together() -> (
    None
):
    """SUMO sees who is inside on a path that does not cross from waiting places only."""
    for pair in ((NORTH, BESIDE), (BESIDE, NORTH)):
        (found,) = link_conflicts(lit(*pair), {0: 0, 1: 1})
        assert not found.shares
        (found,) = link_conflicts(lit(*pair, waiting=(found.yields,)), {0: 0, 1: 1})
        assert found.shares
        (found,) = link_conflicts(lit(*pair, waiting=(1 - found.yields,)), {0: 0, 1: 1})
        assert not found.shares, "the other one has the right of way"


def test_turns_whose_paths_cross_have_green_together() -> None:
    (found,) = link_conflicts(lit(NORTH, ACROSS), {0: 0, 1: 1})
    assert found.shares


def test_crossing_traffic_starts_when_who_waited_inside_has_moved_off() -> None:
    """Oncoming traffic, 10 m/s, has left the turn's path after (21.2 + 6) m: 2.2 s after yellow."""
    turn = turn_left("s", "w", [(1.8, -23.0), (1.8, -8.0), (-1.8, 1.8), (-23.0, 2.0)])
    oncoming = turn_left("n", "s", [(-1.8, 23.0), (-1.8, -23.0)])
    crossing = turn_left("w", "e", [(-23.0, -1.8), (23.0, -1.8)])
    rows = {0: 0, 1: 1, 2: 2}
    seconds = {}
    for waiting in ((), (0,)):
        stages = light_stages(lit(turn, oncoming, crossing, waiting=waiting), rows)
        groups = [group.links for group in stages.groups]
        assert {groups.index((0,)), groups.index((1,))} in stages.green
        first, last = groups.index((0,)), groups.index((2,))
        seconds[waiting] = (
            stages.conflicts.seconds(first, last),
            stages.conflicts.seconds(last, first),
        )
    assert seconds == {(): (1.0, 1.0), (0,): (3.0, 1.0)}
