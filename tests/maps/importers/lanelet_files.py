"""Small Lanelet2 files, written by hand: nodes, ways, lanelets, regulatory elements."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

Point = tuple[float, ...]


class LaneletFile:
    """A file of Autoware's dialect, with coordinates in metres; ids count up from 1."""

    def __init__(self) -> None:
        self.root = ET.Element("osm", {"generator": "VMB"})
        self._count = 0
        self._nodes: dict[Point, str] = {}

    def _add(self, kind: str, tags: Mapping[str, str]) -> ET.Element:
        self._count += 1
        element = ET.SubElement(self.root, kind, {"id": str(self._count)})
        for key, value in tags.items():
            ET.SubElement(element, "tag", {"k": key, "v": value})
        return element

    def node(self, point: Point) -> str:
        """A node at x, y and, if given, z; the same one for the same place."""
        if point not in self._nodes:
            x, y, *z = point
            tags = {"local_x": repr(x), "local_y": repr(y)}
            if z:
                tags["ele"] = repr(z[0])
            element = self._add("node", tags)
            element.set("lat", "35.0")
            element.set("lon", "139.0")
            self._nodes[point] = element.get("id", "")
        return self._nodes[point]

    def way(self, points: Iterable[Point], **tags: str) -> str:
        """A way through points."""
        refs = [self.node(tuple(map(float, point))) for point in points]
        element = self._add("way", tags or {"type": "line_thin", "subtype": "solid"})
        for ref in refs:
            ET.SubElement(element, "nd", {"ref": ref})
        return element.get("id", "")

    def lanelet(
        self,
        left: str | Sequence[str],
        right: str | Sequence[str],
        regulations: Sequence[str] = (),
        **tags: str,
    ) -> str:
        """A lanelet between ways."""
        usual = {"type": "lanelet", "subtype": "road", "location": "urban", "one_way": "yes"}
        element = self._add("relation", usual | tags)
        for role, ways in (("left", left), ("right", right)):
            for way in [ways] if isinstance(ways, str) else ways:
                ET.SubElement(element, "member", {"type": "way", "role": role, "ref": way})
        for name in regulations:
            member = {"type": "relation", "role": "regulatory_element", "ref": name}
            ET.SubElement(element, "member", member)
        return element.get("id", "")

    def regulatory(self, subtype: str, members: Sequence[tuple[str, str, str]], **tags: str) -> str:
        """A regulatory element; members are type, role, id."""
        element = self._add("relation", {"type": "regulatory_element", "subtype": subtype} | tags)
        for kind, role, ref in members:
            ET.SubElement(element, "member", {"type": kind, "role": role, "ref": ref})
        return element.get("id", "")

    def refer(self, lanelet: str, regulatory: str) -> None:
        """Let a lanelet name a regulatory element."""
        relation = next(r for r in self.root.iter("relation") if r.get("id") == lanelet)
        member = {"type": "relation", "role": "regulatory_element", "ref": regulatory}
        ET.SubElement(relation, "member", member)

    def __bytes__(self) -> bytes:
        return ET.tostring(self.root, encoding="utf-8", xml_declaration=True)
