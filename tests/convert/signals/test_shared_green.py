"""What may have green together at a light, given that one of both gives way."""

from __future__ import annotations

from odscen.convert.model.right_of_way import Movement, Rules, find_conflicts, requests
from odscen.convert.signals.shared_green import LightLinks, link_conflicts
from tests.convert.turns import turn_left

NORTH = turn_left("s", "w", [(1.8, -12.0), (1.8, -6.0), (-1.0, 0.6), (-12.0, 1.8)])
BESIDE = turn_left("n", "e", [(-1.0, 12.0), (-1.0, 6.0), (1.0, -0.4), (12.0, -1.8)])
ACROSS = turn_left("n", "e", [(-1.8, 12.0), (-1.8, -1.0), (1.0, -3.0), (12.0, -4.0)])


def may_share(one: Movement, other: Movement) -> bool:
    """Whether two movements, which meet, may have green together."""
    movements = (one, other)
    conflicts = find_conflicts(movements, ())
    assert conflicts.pairs == ((0, 1),)
    rights = requests(movements, conflicts, Rules(signalled=True))
    links = LightLinks(
        movements, (), (("1",), ("2",)), ("", ""), (False, False), conflicts, rights, side=1.0
    )
    (found,) = link_conflicts(links, {0: 0, 1: 1})
    return found.shares


def test_turns_that_pass_too_near_beside_each_other_have_no_green_together() -> None:
    """SUMO sees no vehicle inside on a path that does not cross: both would go."""
    assert not may_share(NORTH, BESIDE)
    assert not may_share(BESIDE, NORTH)


def test_turns_whose_paths_cross_have_green_together() -> None:
    assert may_share(NORTH, ACROSS)
