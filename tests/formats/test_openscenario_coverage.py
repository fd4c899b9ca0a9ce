"""docs/openscenario-coverage.md: held to the sources, the standard, and what the reader does."""

from __future__ import annotations

import os
import re
from pathlib import Path

import pytest
from lxml import etree

from odscen.app.exchange.exports import export
from odscen.app.exchange.imports import import_file
from odscen.figures.measures.figure_docs import between_markers
from odscen.maps.store import Workspace
from tests.app.test_scenario_imports import FILE, SPEED, given
from tools.openscenario_coverage import ACTING, REMARKS, coverage_tables, covered, standard

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs" / "openscenario-coverage.md"
SCHEMAS = sorted(ROOT.glob("build/qc/lib/python*/site-packages/qc_openscenario/schema/*/*.xsd"))
XSD = "{http://www.w3.org/2001/XMLSchema}"
VERDICTS = {row.element: row.verdict for row in covered()}
UNKNOWN = re.compile(r"odscen has no |a place given as ")
"""How the reader refuses a kind that it does not know, whatever is in it."""
USUAL = 'entityRef="Other" value="3" rule="lessThan" freespace="true" tolerance="2" duration="1"'


@pytest.mark.golden
def test_the_tables_of_the_docs_are_those_of_the_sources() -> None:
    new = between_markers(DOCS.read_text(encoding="utf-8"), "coverage", coverage_tables())
    if os.environ.get("ODSCEN_GOLDEN") == "write":
        DOCS.write_text(new, encoding="utf-8")
    assert DOCS.read_text(encoding="utf-8") == new


def test_each_remark_is_about_an_element_of_the_standard() -> None:
    assert VERDICTS.keys() >= REMARKS.keys()
    assert {parent for parent, _ in standard()} >= ACTING


def pairs_of(schema: Path) -> set[tuple[str, str]]:
    """Each element of a schema with what it stands in."""
    root = etree.parse(schema).getroot()
    types = {one.get("name"): one for one in root.iter(f"{XSD}complexType")}
    groups = {one.get("name"): one for one in root.iterchildren(f"{XSD}group")}
    found: set[tuple[str, str]] = set()

    def inside(node: etree._Element, parent: str) -> None:
        for one in node.iterchildren("*"):
            if one.tag == f"{XSD}element":
                pair = (parent, str(one.get("name")))
                if pair not in found:
                    found.add(pair)
                    inside(types.get(one.get("type"), one), pair[1])
            elif one.tag == f"{XSD}group":
                inside(groups[one.get("ref")], parent)
            else:
                inside(one, parent)

    for one in root.iterchildren(f"{XSD}element"):
        inside(types.get(one.get("type"), one), str(one.get("name")))
    return found


@pytest.mark.skipif(not SCHEMAS, reason="build/qc, which has the schemas, is not made")
@pytest.mark.parametrize("version", ["1.0.0", "1.1.1", "1.2.0", "1.3.0"])
def test_the_list_of_elements_is_that_of_the_schema(version: str) -> None:
    (schema,) = (one for one in SCHEMAS if one.parent.name == version)
    listed = {pair for pair, versions in standard().items() if version[:3] in versions}
    assert pairs_of(schema) == listed


def event(number: int, action: str, condition: str) -> str:
    """An event of the actor ``Other``."""
    return (
        f'<Event name="e{number}"><Action name="a"><PrivateAction>{action}</PrivateAction></Action>'
        f'<StartTrigger><ConditionGroup><Condition name="c" delay="0">{condition}</Condition>'
        "</ConditionGroup></StartTrigger></Event>"
    )


def every_kind() -> dict[str, tuple[str, str]]:
    """Action and condition of an event, for each kind of action, condition and position."""
    time = '<SimulationTimeCondition value="1" rule="greaterThan"/>'
    usual = f"<ByValueCondition>{time}</ByValueCondition>"
    found = {}
    for parent, kind in standard():
        one = f"<{kind} {USUAL}/>"
        if parent in ("LongitudinalAction", "LateralAction", "RoutingAction"):
            found[kind] = (f"<{parent}>{one}</{parent}>", usual)
        elif parent == "Position":
            there = f"<AcquirePositionAction><Position>{one}</Position></AcquirePositionAction>"
            found[kind] = (f"<RoutingAction>{there}</RoutingAction>", usual)
        elif parent == "ByValueCondition":
            found[kind] = (SPEED, f"<ByValueCondition>{one}</ByValueCondition>")
        elif parent == "EntityCondition":
            who = '<TriggeringEntities><EntityRef entityRef="Ego"/></TriggeringEntities>'
            said = f"<ByEntityCondition>{who}<EntityCondition>{one}</EntityCondition>"
            found[kind] = (SPEED, f"{said}</ByEntityCondition>")
    return found


@pytest.mark.slow
def test_what_the_table_refuses_is_what_the_reader_does_not_know(tmp_path: Path) -> None:
    kinds = every_kind()
    assert len(kinds) > 40
    events = "".join(event(number, *made) for number, made in enumerate(kinds.values()))
    text = FILE.replace("ACTION", SPEED).replace("</Maneuver>", f"{events}</Maneuver>")
    lists = import_file(Workspace.open(tmp_path / "w"), given(tmp_path, text)).lists
    unknown = {
        re.sub(r"\[\d+\]$", "", row.xpath.rpartition("/")[2])
        for row in lists["refused"]
        if UNKNOWN.match(row.reason)
    }
    assert unknown & kinds.keys() == {kind for kind in kinds if VERDICTS[kind] == "refused"}


@pytest.mark.slow
def test_all_that_is_exported_is_in_the_table_as_written(tmp_path: Path) -> None:
    workspace = Workspace.open(tmp_path / "w")
    workspace.add_map(ROOT / "maps" / "motorway_weave.xodr")
    files = sorted((ROOT / "suites" / "scenarios").glob("motorway_weave*.scenario.json"))
    assert files
    tags = set()
    for file in files:
        export(workspace, file, tmp_path / file.stem, to="openscenario")
        for one in (tmp_path / file.stem).glob("*.xosc"):
            tags |= {str(element.tag) for element in etree.parse(one).iter("*")}
    assert tags <= {row.element for row in covered() if row.written}


ALKS = sorted((ROOT.parent / "shared" / "osc" / "alks" / "concrete_scenarios").glob("*.xosc"))


@pytest.mark.slow
@pytest.mark.skipif(not ALKS, reason="the ALKS scenarios are not here")
def test_what_the_table_does_not_call_read_is_not_read_in_the_alks_files(tmp_path: Path) -> None:
    workspace, read = Workspace.open(tmp_path / "w"), set()
    for file in ALKS:
        lists = import_file(workspace, file).lists
        for row in (*lists["taken"], *lists["approximated"]):
            read.add(re.sub(r"\[\d+\]$", "", row.xpath.rpartition("/")[2]))
    assert len(read) > 50
    assert {VERDICTS[tag] for tag in read} == {"read", "approximated"}
