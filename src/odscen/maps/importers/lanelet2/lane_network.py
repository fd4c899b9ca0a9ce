"""Lanelets as a network: groups side by side, where they branch, merge and cross, cut into parts.

What follows and what is beside what is Lanelet2's own: bounds that end in the nodes in which others
begin, and bounds that are the same line. OpenDRIVE needs more: wherever lanes branch, merge or
cross there is a junction, and in it only connecting roads. So lanelets are cut behind and before
these zones where enough of them is left, and what lies in them connects.
"""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np
import shapely

from odscen.maps.importers.lanelet2.lanelet_file import Bound, Lanelet, reversed_bound
from odscen.maps.importers.lanelet2.road_fitting import along_line, arc_lengths, middle_line

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from odscen.base.arrays import FloatArray
    from odscen.maps.importers.lanelet2.lanelet_file import LaneletMap

_OVERLAP_AREA, _OVERLAP_DEPTH = 0.3, 0.1
"""Square metres and metres by which lanelets that cross overlap at least; less is inaccuracy."""
_BRIDGE = 2.5
"""Metres of height between lanelets that do not meet."""
_PAD = 0.5
_SHORTEST_ROAD, _SHORTEST_BETWEEN = 4.0, 12.0
"""Metres of a lanelet outside a zone that become a road of their own: at an end, between zones."""
_FORK = 5.0
"""Metres of a junction at least where lanes part that do not overlap."""
_STUB, _STUB_SHARE = 5.0, 0.3
"""Metres, and share of a lanelet at most, of the road that leads into a zone at the map's edge."""
_MOST_PATHS: Final = 20_000
_LONGEST_PATH: Final = 30
_LONGEST_ROAD: Final = 1500.0


@dataclass(slots=True, eq=False)
class Group:
    """Lanelets of one direction side by side, from left to right."""

    lanelets: list[Lanelet]
    is_connecting: bool = False

    @property
    def borders(self) -> list[Bound]:
        """Borders from left to right, one more than lanelets."""
        return [self.lanelets[0].left, *(lanelet.right for lanelet in self.lanelets)]


class Path(NamedTuple):
    """A way through a junction: ids of the lanelet before, of those inside, and of the one behind.

    All of them may have more to their right that belong to the same connecting road.
    """

    before: str
    inside: tuple[str, ...]
    after: str


@dataclass(slots=True, eq=False)
class Strip:
    """Groups that follow each other lane by lane, with those of the other direction.

    Attributes
    ----------
    forward
        Groups in the direction of the road.
    backward
        For each of them the group of the other direction that shares its border, or nothing.
    """

    forward: list[Group]
    backward: list[Group] = field(default_factory=list)


@dataclass(slots=True, eq=False)
class LaneNetwork:
    """All lanelets for vehicles, cut where junctions begin and end."""

    source: LaneletMap
    left_hand: bool
    groups: list[Group]
    following: dict[str, list[str]] = field(default_factory=dict)
    preceding: dict[str, list[str]] = field(default_factory=dict)
    group_of: dict[str, tuple[Group, int]] = field(default_factory=dict)

    def lanelet(self, identity: str) -> Lanelet:
        """A lanelet, or a part of one, by its id."""
        group, index = self.group_of[identity]
        return group.lanelets[index]

    def link(self) -> None:
        """Find what follows what, and where each lanelet is."""
        self.group_of = {
            lanelet.id: (group, index)
            for group in self.groups
            for index, lanelet in enumerate(group.lanelets)
        }
        starting: dict[tuple[str, str], list[Lanelet]] = defaultdict(list)
        for group in self.groups:
            for lanelet in group.lanelets:
                starting[lanelet.left.nodes[0], lanelet.right.nodes[0]].append(lanelet)
        self.following = {}
        self.preceding = {identity: [] for identity in self.group_of}
        for group in self.groups:
            for lanelet in group.lanelets:
                end = lanelet.left.nodes[-1], lanelet.right.nodes[-1]
                # The other direction of a lanelet for both is no way to turn round.
                after = [
                    other.id
                    for other in starting.get(end, ())
                    if other.source != lanelet.source or not (other.is_copy or lanelet.is_copy)
                ]
                self.following[lanelet.id] = after
                for identity in after:
                    self.preceding[identity].append(lanelet.id)

    def groups_after(self, group: Group) -> list[Group]:
        """Groups that follow a group, in order."""
        return self._groups_of(n for ll in group.lanelets for n in self.following[ll.id])

    def groups_before(self, group: Group) -> list[Group]:
        """Groups that a group follows, in order."""
        return self._groups_of(n for ll in group.lanelets for n in self.preceding[ll.id])

    def _groups_of(self, identities: Iterable[str]) -> list[Group]:
        found = {id(group): group for group in (self.group_of[n][0] for n in identities)}
        return list(found.values())

    def right_of(self, identity: str) -> str | None:
        """The lanelet to the right in the same direction."""
        group, index = self.group_of[identity]
        return group.lanelets[index + 1].id if index + 1 < len(group.lanelets) else None


def build_network(source: LaneletMap, lanelets: Sequence[Lanelet], rule: str) -> LaneNetwork:
    """Group lanelets, and cut them where they branch, merge and cross.

    Parameters
    ----------
    rule
        ``right``, ``left`` or ``auto``: the side on which traffic keeps.
    """
    groups = _group_side_by_side(lanelets)
    left_hand = rule == "left" or (rule == "auto" and _keeps_left(source, lanelets))
    network = LaneNetwork(source, left_hand, groups)
    network.link()
    _cut_groups(network)
    network.link()
    return network


def _group_side_by_side(lanelets: Sequence[Lanelet]) -> list[Group]:
    by_left = defaultdict(list)
    for lanelet in lanelets:
        by_left[lanelet.left.nodes].append(lanelet)
    right: dict[str, Lanelet] = {}
    taken: set[str] = set()
    for lanelet in lanelets:
        for other in by_left.get(lanelet.right.nodes, ()):
            if other.id not in taken and other is not lanelet:
                right[lanelet.id] = other
                taken.add(other.id)
                break
    groups = []
    for lanelet in lanelets:
        if lanelet.id in taken:
            continue
        chain = [lanelet]
        while chain[-1].id in right:
            chain.append(right[chain[-1].id])
        groups.append(Group(chain))
    return groups


def _keeps_left(source: LaneletMap, lanelets: Sequence[Lanelet]) -> bool:
    """Whether oncoming traffic is on the right: by shared borders, else by the nearest lanelets."""
    backwards = {ll.left.nodes[::-1] for ll in lanelets}, {ll.right.nodes[::-1] for ll in lanelets}
    by_left = sum(ll.left.nodes in backwards[0] for ll in lanelets if not ll.is_copy)
    by_right = sum(ll.right.nodes in backwards[1] for ll in lanelets if not ll.is_copy)
    if by_left != by_right:
        return by_right > by_left
    places, headings = [], []
    for lanelet in lanelets:
        if lanelet.is_copy:
            continue
        middle = middle_line(source.line(lanelet.left.nodes), source.line(lanelet.right.nodes))
        run = arc_lengths(middle)
        at = np.arange(0.0, run[-1], 5.0)
        points = along_line(middle, at)[:, :2]
        ahead = along_line(middle, np.minimum(at + 0.5, run[-1]))[:, :2] - points
        places.append(points)
        headings.append(ahead / np.maximum(np.hypot(*ahead.T), 1e-9)[:, None])
    place, heading = np.concatenate(places), np.concatenate(headings)
    from scipy.spatial import cKDTree

    votes = 0
    for k, near in enumerate(cKDTree(place).query_ball_point(place, 20.0)):
        others = np.array(near)
        opposed = others[heading[others] @ heading[k] < -0.8]
        apart = place[opposed] - place[k]
        side = heading[k][0] * apart[:, 1] - heading[k][1] * apart[:, 0]
        votes += int(np.sign(side[np.abs(side) > 1.0]).sum())
    return votes < 0


# ----------------------------------------------------------------------------- junction zones
def overlapping_pairs(
    source: LaneletMap, lanelets: Sequence[Lanelet]
) -> Iterator[tuple[int, int, FloatArray]]:
    """Pairs of lanelets that cross at one height: rows, and corners of what they share."""
    lines = [(source.line(ll.left.nodes), source.line(ll.right.nodes)) for ll in lanelets]
    shapes = [
        shapely.Polygon(np.concatenate([left, right[::-1]])[:, :2]).buffer(0.0)
        for left, right in lines
    ]
    if not shapes:
        return
    tree = shapely.STRtree(shapes)
    first, second = tree.query(shapes, predicate="intersects")
    pairs = sorted((a, b) for a, b in zip(first.tolist(), second.tolist(), strict=True) if a < b)
    for a, b in pairs:
        if lanelets[a].source == lanelets[b].source:
            continue
        shared = shapes[a].intersection(shapes[b])
        if shared.area < _OVERLAP_AREA or shared.buffer(-_OVERLAP_DEPTH).is_empty:
            continue
        corners = shapely.get_coordinates(shared)
        place = shapely.Point(shared.representative_point())
        heights = []
        for row in (a, b):
            middle = shapely.LineString(middle_line(*lines[row]))
            heights.append(middle.interpolate(middle.project(place)).z)
        if abs(heights[0] - heights[1]) < _BRIDGE:
            yield a, b, corners


def _cut_groups(network: LaneNetwork) -> None:
    """Find the zones of junctions on each group, and cut groups at their ends."""
    lanelets = [lanelet for group in network.groups for lanelet in group.lanelets]
    group_of = {ll.id: group for group in network.groups for ll in group.lanelets}
    middles = {id(group): _group_middle(network.source, group) for group in network.groups}
    zones: dict[int, list[tuple[float, float]]] = defaultdict(list)
    for a, b, corners in overlapping_pairs(network.source, lanelets):
        first, second = group_of[lanelets[a].id], group_of[lanelets[b].id]
        if first is second:
            continue
        if lanelets[b].id in network.following[lanelets[a].id]:
            continue
        if lanelets[a].id in network.following[lanelets[b].id]:
            continue
        for group in (first, second):
            middle = shapely.LineString(middles[id(group)][:, :2])
            at = shapely.line_locate_point(middle, shapely.points(corners))
            zones[id(group)].append((float(at.min()) - _PAD, float(at.max()) + _PAD))
    cut = []
    for group in network.groups:
        size = float(arc_lengths(middles[id(group)])[-1])
        before, after = network.groups_before(group), network.groups_after(group)
        parting = any(len(network.groups_after(other)) > 1 for other in before)
        joining = any(len(network.groups_before(other)) > 1 for other in after)
        own = zones[id(group)]
        if parting:
            own.append((0.0, min(_FORK, size)))
        if joining:
            own.append((max(0.0, size - _FORK), size))
        if not own:
            cut.append(group)
            continue
        spans = _junction_spans(own, size)
        # Lanes that begin or end at the edge of the map need a road to come from or to go to.
        stub = min(_STUB, _STUB_SHARE * size)
        if spans[0][0] <= 0.0 and not parting and not _are_all_linked(group, network.preceding):
            spans[0] = (stub, max(spans[0][1], 2.0 * stub))
        if spans[-1][1] >= size and not joining and not _are_all_linked(group, network.following):
            spans[-1] = (min(spans[-1][0], size - 2.0 * stub), size - stub)
        cut.extend(_cut_group(network.source, group, middles[id(group)], spans))
    network.groups = cut


def _are_all_linked(group: Group, links: dict[str, list[str]]) -> bool:
    return all(links[lanelet.id] for lanelet in group.lanelets)


def _group_middle(source: LaneletMap, group: Group) -> FloatArray:
    borders = group.borders
    return middle_line(source.line(borders[0].nodes), source.line(borders[-1].nodes))


def _junction_spans(zones: Sequence[tuple[float, float]], size: float) -> list[tuple[float, float]]:
    """Stretches that connect: zones joined, with what is too short to be a road."""
    spans: list[tuple[float, float]] = []
    for start, end in sorted(zones):
        low = 0.0 if start < _SHORTEST_ROAD else start
        high = size if end > size - _SHORTEST_ROAD else end
        if spans and low - spans[-1][1] < _SHORTEST_BETWEEN:
            spans[-1] = (spans[-1][0], max(spans[-1][1], high))
        else:
            spans.append((low, high))
    return spans


def _cut_group(
    source: LaneletMap, group: Group, middle: FloatArray, spans: Sequence[tuple[float, float]]
) -> Iterator[Group]:
    """Parts of a group, those of the spans connecting."""
    run = arc_lengths(middle)
    cuts = sorted({at for span in spans for at in span if 0.0 < at < run[-1]})
    if not cuts:
        yield Group(group.lanelets, is_connecting=True)
        return
    borders = group.borders
    indices: list[list[int]] = [[0] for _ in borders]
    for number, at in enumerate(cuts):
        point = along_line(middle, np.array([at]))[0]
        ends = along_line(middle, np.array([max(0.0, at - 0.5), min(run[-1], at + 0.5)]))[:, :2]
        ahead = (ends[1] - ends[0]) / np.hypot(*(ends[1] - ends[0]))
        for k, border in enumerate(borders):
            name = f"{group.lanelets[0].id}/{number + 1}.{k}"
            borders[k], index = _insert_node(
                source, border, name, point, ahead, after=indices[k][-1]
            )
            indices[k].append(index)
    for k, border in enumerate(borders):
        indices[k].append(len(border.nodes) - 1)
    edges = [0.0, *cuts, float(run[-1])]
    for part in range(len(cuts) + 1):
        sliced = [
            _slice_bound(border, indices[k][part], indices[k][part + 1])
            for k, border in enumerate(borders)
        ]
        middle_at = (edges[part] + edges[part + 1]) / 2.0
        yield Group(
            [
                replace(
                    lanelet, id=f"{lanelet.id}/{part + 1}", left=left, right=right, part=part + 1
                )
                for lanelet, left, right in zip(
                    group.lanelets, sliced[:-1], sliced[1:], strict=True
                )
            ],
            is_connecting=any(low <= middle_at <= high for low, high in spans),
        )


def _insert_node(
    source: LaneletMap,
    border: Bound,
    name: str,
    point: FloatArray,
    ahead: FloatArray,
    *,
    after: int,
) -> tuple[Bound, int]:
    """Put a node where a border crosses the line square to ``ahead`` through a point."""
    line = source.line(border.nodes)
    beyond = (line[:, :2] - point[:2]) @ ahead
    best: tuple[float, int, FloatArray] | None = None
    for k in range(after, len(line) - 1):
        if not beyond[k] <= 0.0 <= beyond[k + 1] or beyond[k] == beyond[k + 1]:
            continue
        share = beyond[k] / (beyond[k] - beyond[k + 1])
        place = line[k] + share * (line[k + 1] - line[k])
        apart = float(np.hypot(*(place - point)[:2]))
        if best is None or apart < best[0]:
            best = apart, k, place
    if best is None:  # the border is far from square there: its nearest point
        k = max(after, min(int(np.argmin(np.hypot(*(line - point)[:, :2].T))), len(line) - 2))
        best = 0.0, k, (line[k] + line[k + 1]) / 2.0
    _, k, place = best
    source.points[name] = place
    nodes = (*border.nodes[: k + 1], name, *border.nodes[k + 1 :])
    ways = tuple((start + (start > k), way) for start, way in border.ways)
    return Bound(nodes, ways), k + 1


def _slice_bound(bound: Bound, first: int, last: int) -> Bound:
    nodes = bound.nodes[first : last + 1]
    ends = [start for start, _ in bound.ways[1:]] + [len(bound.nodes) - 1]
    ways = tuple(
        (max(0, start - first), way)
        for (start, way), end in zip(bound.ways, ends, strict=True)
        if end > first and start < last
    )
    return Bound(nodes, ways)


# ----------------------------------------------------------------------------- roads, paths
def find_paths(network: LaneNetwork) -> tuple[list[Path], bool]:
    """Ways through junctions from road to road, and whether there are more than can be followed."""
    connecting = {
        lanelet.id for group in network.groups if group.is_connecting for lanelet in group.lanelets
    }
    paths = []
    for identity in network.group_of:
        if identity in connecting:
            continue
        todo: list[tuple[str, ...]] = [
            (n,) for n in reversed(network.following[identity]) if n in connecting
        ]
        while todo:
            inside = todo.pop()
            for after in reversed(network.following[inside[-1]]):
                if after not in connecting:
                    paths.append(Path(identity, inside, after))
                    if len(paths) > _MOST_PATHS:
                        return paths, True
                elif after not in inside and len(inside) < _LONGEST_PATH:
                    todo.append((*inside, after))
    return paths, False


def bundle_paths(network: LaneNetwork, paths: Sequence[Path]) -> list[list[Path]]:
    """Paths side by side from one road to another, from left to right."""
    known = set(paths)
    right: dict[Path, Path] = {}
    for path in paths:
        parts = [network.right_of(n) for n in (path.before, *path.inside, path.after)]
        if all(part is not None for part in parts):
            other = Path(str(parts[0]), tuple(map(str, parts[1:-1])), str(parts[-1]))
            if other in known:
                right[path] = other
    second = set(right.values())
    bundles = []
    for path in paths:
        if path not in second:
            bundle = [path]
            while bundle[-1] in right:
                bundle.append(right[bundle[-1]])
            bundles.append(bundle)
    return bundles


def build_strips(network: LaneNetwork) -> list[Strip]:
    """Roads outside junctions: both directions together where they share a border."""
    roads = [group for group in network.groups if not group.is_connecting]
    inner = {
        id(group): (group.borders[-1] if network.left_hand else group.borders[0]).nodes
        for group in roads
    }
    by_inner: dict[tuple[str, ...], list[Group]] = defaultdict(list)
    for group in roads:
        by_inner[inner[id(group)]].append(group)
    partner: dict[int, Group] = {}
    for group in roads:
        others = [
            other
            for other in by_inner.get(inner[id(group)][::-1], ())
            if id(other) not in partner and other.lanelets[0].source != group.lanelets[0].source
        ]
        if others and id(group) not in partner:
            partner[id(group)] = others[0]
            partner[id(others[0])] = group
    while True:
        strips = _chain_groups(network, roads, partner)
        split = [
            strip for strip in strips if strip.backward and _has_two_neighbours(network, strip)
        ]
        if not split:
            return strips
        # The two directions go separate ways there: each is a road of its own.
        for strip in split:
            for group in (*strip.forward, *strip.backward):
                partner.pop(id(group), None)


def _chain_groups(
    network: LaneNetwork, roads: Sequence[Group], partner: dict[int, Group]
) -> list[Strip]:
    def next_group(group: Group) -> Group | None:
        """The group that continues a group lane by lane, its partner likewise."""
        after = _find_continuation(network, group)
        if after is None:
            return None
        mine, other = partner.get(id(group)), partner.get(id(after))
        if mine is None and other is None:
            return after
        if mine is None or other is None:
            return None
        return after if _find_continuation(network, other) is mine else None

    before = {id(after): group for group in roads if (after := next_group(group))}
    strips: list[Strip] = []
    used: set[int] = set()
    for start in (*(g for g in roads if id(g) not in before), *roads):
        group = start
        if id(group) in used:
            continue
        chain: list[Group] = []
        size = 0.0
        while group is not None and id(group) not in used:
            length = float(arc_lengths(_group_middle(network.source, group))[-1])
            if chain and size + length > _LONGEST_ROAD:
                break
            chain.append(group)
            size += length
            mates = [partner[id(group)]] if id(group) in partner else []
            used.update(map(id, (group, *mates)))
            group = next_group(group)  # type: ignore[assignment]
        strips.append(Strip(chain, [partner[id(g)] for g in chain if id(g) in partner]))
        if group is not None and id(group) not in used:
            strips.extend(_chain_groups(network, [g for g in roads if id(g) not in used], partner))
            return strips
    return strips


def _find_continuation(network: LaneNetwork, group: Group) -> Group | None:
    """The road that goes on with the same lanes, if there is one."""
    after = network.groups_after(group)
    if len(after) != 1 or after[0].is_connecting or after[0] is group:
        return None
    found = after[0]
    if len(found.lanelets) != len(group.lanelets) or network.groups_before(found) != [group]:
        return None
    for mine, other in zip(group.lanelets, found.lanelets, strict=True):
        if network.following[mine.id] != [other.id] or mine.subtype != other.subtype:
            return None
    return found


def _has_two_neighbours(network: LaneNetwork, strip: Strip) -> bool:
    """Whether the two directions lead to different roads, or one of them into a junction."""
    for last, first in (
        (strip.forward[-1], strip.backward[-1]),
        (strip.backward[0], strip.forward[0]),
    ):
        to = network.groups_after(last)
        come = network.groups_before(first)
        if not to or not come:
            continue
        connects = {group.is_connecting for group in (*to, *come)}
        if len(connects) > 1:
            return True
        if connects == {True}:
            continue
        # Without a junction the neighbours must share their border as well.
        if len(to) != 1 or len(come) != 1:
            return True
        border = (to[0].borders[-1] if network.left_hand else to[0].borders[0]).nodes
        other = (come[0].borders[-1] if network.left_hand else come[0].borders[0]).nodes
        if border != other[::-1]:
            return True
    return False


def copy_for_both_directions(lanelet: Lanelet) -> Lanelet:
    """The other direction of a lanelet that is driven both ways."""
    return replace(
        lanelet,
        id=f"{lanelet.id}~",
        left=reversed_bound(lanelet.right),
        right=reversed_bound(lanelet.left),
        is_copy=True,
    )
