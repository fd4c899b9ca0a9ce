"""docs/opendrive-coverage.md says what is read: hold it to the reader and to the standard."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest
from lxml import etree

from odscen.base.errors import OpenDriveError
from odscen.opendrive.parse import parse
from odscen.opendrive.parse_rules import Rule
from odscen.opendrive.road_model import OpenDrive
from tests.opendrive.full import FULL
from tests.opendrive.standard import VERSIONS, schema_folder, schema_rows

TABLE = Path(__file__).parents[2] / "docs" / "opendrive-coverage.md"
ROW = re.compile(r"^\| `([^`]+)` \| (.*?) \| (.*?) \| (.*?) \|$", re.MULTILINE)
EVERYWHERE = {"userData", "include", "dataQuality", "_OpenDriveElement"}

# Values other than the ones in FULL, where not any number or text will do.
OTHERS = {
    ("OpenDRIVE/header", "revMinor"): "8",
    ("OpenDRIVE/road", "rule"): "LHT",
    ("OpenDRIVE/road", "junction"): {"-1": "9", "9": "-1"},
    ("OpenDRIVE/road", "length"): {"100": "100.0005", "20": "20.0005"},
    ("OpenDRIVE/junction", "type"): {"default": "direct", "direct": "default"},
    ("OpenDRIVE/controller", "sequence"): "3",
    ("link/predecessor", "elementType"): {"road": "junction", "junction": "road"},
    ("link/successor", "elementType"): {"road": "junction", "junction": "road"},
    ("link/predecessor", "contactPoint"): "start",
    ("link/successor", "contactPoint"): "end",
    ("type/speed", "unit"): "mph",
    ("lane/speed", "unit"): "mph",
    ("lanes/laneSection", "singleSide"): "true",
    ("lanes/laneSection", "s"): {"40": "41"},
    ("left/lane", "id"): {"2": "3"},
    ("right/lane", "id"): {"-1": "-2"},
    ("left/lane", "level"): "true",
    ("right/lane", "level"): "true",
    ("center/lane", "level"): "true",
    ("left/lane", "direction"): "reversed",
    ("right/lane", "direction"): "reversed",
    ("lane/roadMark", "laneChange"): "increase",
    ("lane/access", "rule"): "allow",
    ("geometry/paramPoly3", "pRange"): "normalized",
    ("planView/geometry", "length"): {"50": "50.0005", "30": "30.0005", "20": "20.0005"},
    ("planView/geometry", "s"): {"50": "50.0005", "80": "80.0005"},
    ("outline", "outer"): "false",
    ("outline", "closed"): "false",
    ("signals/signal", "dynamic"): {"yes": "no", "no": "yes"},
    ("signals/signal", "unit"): "mph",
    ("junction/connection", "contactPoint"): "end",
}


def other_value(key: str, name: str, value: str) -> str | None:
    """A different value of the same kind, or ``None`` where this occurrence has none."""
    found = OTHERS.get((key, name)) or OTHERS.get((key.rsplit("/", maxsplit=1)[-1], name))
    if isinstance(found, dict):
        return found.get(value)
    if found is not None:
        return found
    try:
        number = float(value)
    except ValueError:
        return value + "x"
    whole = value.lstrip("-").isdigit()
    return str(int(value) + 1) if whole else repr(number + 0.0005 * max(abs(number), 1e-9))


def model_of(text: str) -> OpenDrive:
    return replace(parse(text), notes=())


def rows() -> dict[str, tuple[set[str], set[str], str]]:
    """Element to (read, not read, reason)."""
    found = {}
    for key, read, unread, reason in ROW.findall(TABLE.read_text()):
        names = [set(re.findall(r"`([^`]+)`", cell)) for cell in (read, unread)]
        found[key] = (names[0], names[1], reason.strip())
    return found


def occurrences() -> Iterator[tuple[str, str, str]]:
    """Element, attribute and whole text with another value, for each attribute in FULL."""
    root = etree.fromstring(FULL.encode())
    for element in root.iter(etree.Element):
        parent = element.getparent()
        key = f"{parent.tag}/{element.tag}" if parent is not None else str(element.tag)
        for name, value in list(element.items()):
            changed = other_value(key, name, value)
            if changed is None:
                continue
            element.set(name, changed)
            yield key, name, etree.tostring(root).decode()
            element.set(name, value)


def effects() -> dict[tuple[str, str], bool]:
    """Whether changing each attribute of FULL changes the model, or is refused."""
    plain = model_of(FULL)
    found: dict[tuple[str, str], bool] = {}
    for key, name, text in occurrences():
        try:
            changes = model_of(text) != plain
        except OpenDriveError:
            changes = True
        found[key, name] = found.get((key, name), False) or changes
    return found


@pytest.mark.slow
def test_what_the_table_calls_read_changes_the_model_and_nothing_else_does() -> None:
    table = rows()
    found = effects()
    said = {(key, name) for key, (read, _, _) in table.items() for name in read}
    assert said - found.keys() == set(), "read, but not in FULL"
    assert {pair for pair, changes in found.items() if changes} == said


def test_every_attribute_of_the_table_is_either_read_or_not_and_says_why_not() -> None:
    for key, (read, unread, reason) in rows().items():
        assert not read & unread, key
        assert reason or not unread, f"{key}: why not?"


def test_elements_that_count_by_being_there_change_the_model() -> None:
    plain = model_of(FULL)
    shapes = {"line": '<arc curvature="0.001"/>'}
    for tag, other in shapes.items():
        assert model_of(FULL.replace(f"<{tag}/>", other, 1)) != plain
    changed = FULL.replace("+lat_0=0", "+lat_0=1")
    assert model_of(changed) != plain


@pytest.mark.parametrize("version", VERSIONS)
def test_the_table_names_every_element_and_attribute_of_the_standard(version: str) -> None:
    folder = schema_folder()
    if folder is None:
        pytest.skip("asam-qc-opendrive, which brings the schemas, is not installed")
    table = rows()
    missing = {
        (key, name)
        for key, name in schema_rows(folder / version)
        if not EVERYWHERE & set(key.split("/"))
        and (key not in table or (name and name not in table[key][0] | table[key][1]))
    }
    assert missing == set()


def test_the_document_lists_every_tolerance_once() -> None:
    tolerances = TABLE.read_text(encoding="utf-8").partition("## Tolerances")[2]
    listed = re.findall(r"^\| `([a-z0-9-]+)` \|", tolerances, re.MULTILINE)
    assert sorted(listed) == sorted(Rule)
