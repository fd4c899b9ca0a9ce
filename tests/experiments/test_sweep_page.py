from typing import Any

import pytest
from lxml import html

from odscen.experiments.sweep_page import SweepShown, sweep_page


def row(number: int, safe: bool | None, **values: Any) -> dict[str, Any]:
    measures = {"collision": False, "impact_speed": None, "min_ttc": None, "min_pet": None}
    about = {"case": f"case-{number:03}", "status": "completed", "safe": safe, "detail": None}
    return about | values | measures | {"max_drac": None}


def page(rows: list[dict[str, Any]], **units: str) -> Any:
    shown = SweepShown("cut & in", units, ["no collision"], rows, {r["case"]: [] for r in rows})
    text = sweep_page(shown)
    assert text == sweep_page(shown)
    return html.fromstring(text)


def test_two_parameters_make_a_plane_with_a_boundary() -> None:
    rows = [row(10 * x + y, x > 2, a=x, b=y) for x in range(5) for y in range(4)]
    found = page(rows, a="m", b="")
    [line] = found.xpath('//path[@class="safe-boundary"]/@d')
    assert line.count("M") >= 3
    assert len(found.xpath('//section[@id="boundary"]//circle')) == 20
    assert found.xpath('string(//section[@id="boundary"]//*[@class="axis-name"][2])') == "a, m"
    assert found.xpath("string(//h1)") == "cut & in"
    assert "8 of 20 safe" in found.text_content()


@pytest.mark.parametrize("count", [1, 3])
def test_one_or_three_parameters_have_no_boundary_but_a_line_for_each_case(count: int) -> None:
    names = "abc"[:count]
    rows = [row(k, k > 3, **dict.fromkeys(names, float(k))) for k in range(9)]
    for k, one in enumerate(rows):
        one["min_ttc"] = 0.5 * k
    found = page(rows, **dict.fromkeys(names, "m"))
    assert found.xpath('//path[@class="safe-boundary"]') == []
    assert len(found.xpath('//g[starts-with(@class, "case-lines")]/path')) == 9
    assert found.xpath('//section[@id="influence"]//td[@class="n"]/text()') == ["1"] * count


def test_a_case_that_was_not_run_says_why() -> None:
    rows = [row(1, True, a=1.0), row(2, None, a=2.0) | {"status": "refused", "detail": "too <far>"}]
    found = page(rows, a="")
    assert "1 of 1 safe" in found.text_content()
    assert "refused: too <far>" in found.xpath("string(//table)")
