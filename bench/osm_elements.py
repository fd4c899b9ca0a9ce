"""What becomes of each element of OpenStreetMap extracts that acts on traffic, by extract.

The elements are counted on the files by this script, which knows nothing of the importer; what
became of them is what the import report has of their ids. One that the report does not name is
*unnamed*, which is a defect. Extracts are those of ``$ODSCEN_TEST_PLACES``, else of
``../shared/places/osm``. ``--reasons`` prints why elements are lost.
"""

from __future__ import annotations

import argparse
import tempfile
from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING
from xml.etree import ElementTree as ET

from bench.common import osm_extracts, unpacked
from odscen.maps.importers.base import ImportSettings
from odscen.maps.store import Workspace

if TYPE_CHECKING:
    from collections.abc import Iterator

NODES = {
    "crossing": "crossing",
    "traffic_signals": "signals",
    "stop": "stop, give way",
    "give_way": "stop, give way",
}
TAGS = {"turn:lanes": "turn:lanes", "maxspeed": "limit"}
KINDS = ("crossing", "signals", "stop, give way", "restriction", "turn:lanes", "limit")
FATES = ("kept", "guessed", "repaired", "lost", "unnamed")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--reasons", action="store_true")
    options = parser.parse_args()
    extracts = osm_extracts()
    if not extracts:
        return
    print(f"{'extract':30}{'':18}{'all':>6}", *(f"{fate:>9}" for fate in FATES))
    total: Counter[str] = Counter()
    reasons: Counter[str] = Counter()
    for extract in extracts:
        content = unpacked(extract)
        rows = _import_rows(extract)
        found = list(_find_elements(content))
        for kind in KINDS:
            fates = Counter[str]()
            for source, tag in (pair for of, *pair in found if of == kind):
                fate, reason = _find_fate(rows, source, tag)
                fates[fate] += 1
                if fate == "lost":
                    reasons[f"{kind}: {reason}"] += 1
            if fates:
                name = extract.name.split(".")[0]
                counts = (f"{fates[fate]:9}" for fate in FATES)
                print(f"{name:30}{kind:18}{fates.total():6}", *counts, flush=True)
            total.update(fates)
    print(f"{'all':48}{total.total():6}", *(f"{total[fate]:9}" for fate in FATES))
    if options.reasons:
        for reason, count in reasons.most_common():
            print(f"{count:6} {reason}")


def _find_elements(content: bytes) -> Iterator[tuple[str, str, str]]:
    """Kind, element and tag of what acts on traffic."""
    for item in ET.fromstring(content):
        if item.get("action") == "delete":
            continue
        tags = {tag.get("k", ""): tag.get("v", "") for tag in item.iter("tag")}
        source = f"{item.tag} {item.get('id')}"
        kind = NODES.get(tags.get("highway", ""))
        if item.tag == "node" and kind:
            yield kind, source, ""
        if item.tag == "relation" and tags.get("type", "").startswith("restriction"):
            yield "restriction", source, ""
        if item.tag == "way" and "highway" in tags:
            for key in tags:
                start = next((name for name in TAGS if key.startswith(name)), None)
                if start and key not in ("maxspeed:type", "maxspeed:conditional"):
                    yield TAGS[start], source, key


def _import_rows(extract: Path) -> list[dict[str, str]]:
    with tempfile.TemporaryDirectory() as folder:
        workspace = Workspace.open(Path(folder))
        entry = workspace.add_map(extract, name="place", importing=ImportSettings("openstreetmap"))
        rows: list[dict[str, str]] = entry.info["report"]["entries"]
        return rows


def _find_fate(rows: list[dict[str, str]], source: str, tag: str) -> tuple[str, str]:
    """What became of an element; of several rows the one that says most was done."""
    said = [
        (FATES.index(row["fate"]), row["reason"])
        for row in rows
        if row.get("source_id") == source and (not tag or row["reason"].startswith(tag))
    ]
    if not said:
        return "unnamed", ""
    rank, reason = min(said)
    return FATES[rank], reason
