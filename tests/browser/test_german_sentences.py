"""What the server says is German on the German page: findings, refusals, uploads and reports."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path

import pytest
from playwright.sync_api import Locator, expect

from odscen.app.scenarios import SUFFIX
from tests.browser.conftest import ARTEFACTS, CROSSING
from tests.browser.pages import OdscenPage
from tests.browser.test_openscenario import REFUSED, ROAD, drop
from tools.page import Served

ENGLISH = re.compile(
    r"\b(the|and|is|are|has|have|not|which|there|of|to|at|it|by|no|from|with|than|lies|lane|lanes)\b"
)
"""Words that every English sentence of the server has one of, and no German one."""
GERMAN = "localStorage.setItem('odscen.preferences', JSON.stringify({language: 'de'}))"


def english(place: Locator) -> list[str]:
    """Lines of what is seen with an English word; paths of elements of files are none."""
    lines = place.inner_text().splitlines()
    plain = [
        re.sub(r"\(?(road|junction|signal|object) \S+( > .*)?|lane=|<\w+>", "", one)
        for one in lines
    ]
    return [one for one, text in zip(lines, plain, strict=True) if ENGLISH.search(text)]


@pytest.fixture
def german(open_page: Callable[..., OdscenPage], served: Served) -> OdscenPage:
    """A page whose reader has chosen German."""
    user = open_page(served.url)
    user.page.add_init_script(GERMAN)
    ARTEFACTS.mkdir(parents=True, exist_ok=True)
    return user


@pytest.mark.slow
def test_findings_and_a_refused_edit_are_in_german(
    german: OdscenPage, served: Served, sampled: str
) -> None:
    path = Path(served.workspace, "scenarios", f"{sampled}{SUFFIX}")
    document = json.loads(path.read_text(encoding="utf-8"))
    fast, late, other, lost = document["actors"][:4]
    fast["speed"] = 80.0
    late["depart"] = 1e6
    other["spawn"] = fast["spawn"]
    lost["goal"] = "nowhere"
    document["criteria"] = ["no_such_figure >= 1"]
    document["roi"].append(document["roi"][0])
    path.write_text(json.dumps(document), encoding="utf-8")
    page = german.page
    page.goto(f"/#/edit/{sampled}")
    problems = page.get_by_role("region", name="Probleme")
    expect(problems).to_contain_text("80 m/s (288 km/h) schnell sein; plausibel sind")
    expect(problems).to_contain_text("der Lauf endet aber bei")
    expect(problems).to_contain_text("nowhere, das die Karte nicht hat")
    expect(problems).to_contain_text("2-mal aufgeführt")
    page.screenshot(path=ARTEFACTS / "german-findings.png")
    assert english(problems) == []

    region = page.get_by_role("region", name="Gebiet", exact=True)
    region.locator("button[aria-expanded]").first.click()
    german.map.click(german.graph.middle(german.graph.junction()))
    expect(german.refusal).to_contain_text("Segment")
    page.screenshot(path=ARTEFACTS / "german-refusal.png")
    assert english(german.refusal) == []


@pytest.mark.slow
def test_a_failed_upload_and_the_report_of_a_conversion_are_in_german(german: OdscenPage) -> None:
    page = german.page
    page.goto("/")
    page.wait_for_load_state("networkidle")  # nobody is as quick as a test
    page.wait_for_timeout(1500)
    with page.expect_file_chooser() as chooser:
        page.get_by_role("button", name="Datei wählen").click()
    text = b"<OpenDRIVE><header revMajor='1' revMinor='4'/></OpenDRIVE>"
    chooser.value.set_files({"name": "broken.xodr", "mimeType": "text/xml", "buffer": text})
    said = page.get_by_role("alert").filter(has_text="broken.xodr")
    said.locator("summary").click()
    expect(said).to_contain_text("broken.xodr: <road> fehlt")
    assert english(said) == []

    page.get_by_role("button", name=f"Importbericht von {CROSSING}").click()
    report = page.get_by_role("dialog")
    expect(report.get_by_role("listitem").first).to_be_visible()
    page.screenshot(path=ARTEFACTS / "german-conversion.png")
    assert english(report) == []


@pytest.mark.slow
def test_the_report_of_an_import_is_in_german(german: OdscenPage) -> None:
    page = german.page
    page.goto("/")
    expect(page.get_by_role("heading", level=1)).to_be_visible()
    drop(page, {"cut_in.xosc": REFUSED, "road.xodr": ROAD})
    report = page.locator(".import-side")
    expect(report).to_contain_text("cut_in.xosc")
    page.screenshot(path=ARTEFACTS / "german-import.png")
    assert english(report) == []
