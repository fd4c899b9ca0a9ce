from __future__ import annotations

import re
from html.parser import HTMLParser

import pytest
from jinja2 import UndefinedError

from odscen.base.markup import Markup, element
from odscen.reports import page_templates
from odscen.reports.page_templates import html_page, html_table, page_head, report_section

EVIL = '<script>alert("1")</script>\x00\ud800\''
SAFE = "&lt;script&gt;alert(&#34;1&#34;)&lt;/script&gt;?&#39;"


def flat(markup: str) -> str:
    return re.sub(r"\n", "", markup)


def test_a_section_has_its_heading_its_parts_and_how_to_read_it() -> None:
    section = report_section("Speed", element("p", "a"), None, explained="fast & slow", ident="v")
    assert flat(section) == (
        '<section id="v"><h2>Speed</h2><p>a</p>'
        '<p class="how"><b>How to read this: </b>fast &amp; slow</p></section>'
    )


def test_a_table_is_named_after_its_first_column_and_keeps_its_attributes() -> None:
    table = html_table(("A", "B"), [element("tr", element("td", 1))], class_="places")
    assert flat(table) == (
        '<div class="scroll" tabindex="0" role="region" aria-label="A"><table class="places">'
        '<thead><tr><th scope="col">A</th><th scope="col">B</th></tr></thead>'
        "<tbody><tr><td>1</td></tr></tbody></table></div>"
    )


def test_the_head_has_a_verdict_if_one_is_given() -> None:
    assert "verdict" not in page_head("Comparison", "a and b")
    head = page_head("Report", "a", verdict="Completed", style="good")
    assert '<p class="verdict good">Completed</p>' in head


@pytest.mark.parametrize(
    "made",
    [
        page_head(EVIL, "", verdict="v", style="good"),
        page_head("", EVIL),
        page_head("", "", verdict=EVIL),
        page_head("", "", verdict="v", style=EVIL),
        report_section(EVIL, explained="", ident=""),
        report_section("", explained=EVIL, ident=""),
        report_section("", explained="", ident=EVIL),
        html_table([EVIL], []),
        html_table(["a"], [], label=EVIL),
    ],
)
def test_whatever_is_put_into_a_template_is_escaped_and_can_be_written(made: Markup) -> None:
    assert SAFE in made
    assert "<script" not in made
    assert "\x00" not in made
    made.encode()


def test_a_page_nests_and_allows_its_own_script_only() -> None:
    page = html_page(EVIL, element("p", "text"))
    assert f"<title>{SAFE}</title>" in page
    assert page.startswith("<!DOCTYPE html>\n<html lang=")
    assert re.search(r"script-src 'sha256-[A-Za-z0-9+/]{43}='", page)
    open_tags: list[str] = []
    reader = HTMLParser()
    reader.handle_starttag = lambda tag, _: None if tag == "meta" else open_tags.append(tag)
    reader.handle_endtag = lambda tag: None if open_tags.pop() == tag else pytest.fail(tag)
    reader.feed(page)
    assert open_tags == []


def test_a_name_that_is_not_given_is_an_error() -> None:
    with pytest.raises(UndefinedError, match="title"):
        page_templates.render_page("run_report.html.j2", title="", head={})
