"""Studies in the page: scenarios chosen, run with seeds and weather, and their means read."""

from __future__ import annotations

import re

import polars as pl
import pytest
from playwright.sync_api import Locator, expect

from odscen.maps.store import Workspace
from tests.browser.pages import OdscenPage
from tools import page as tool

WET = "Heavy rain"


def row(table: Locator, variant: str) -> Locator:
    return table.get_by_role("row").filter(has_text=variant)


@pytest.mark.slow
def test_a_study_is_begun_by_mouse_and_its_means_are_those_of_the_table(
    user: OdscenPage, served: tool.Served, sampled: str
) -> None:
    page = user.page
    user.open_catalogue()
    page.get_by_role("link", name="Studies").click()
    expect(page.get_by_role("button", name="Start the study")).to_be_disabled()
    page.get_by_role("textbox", name="Scenarios").click()
    page.get_by_role("option", name=sampled).click()
    page.keyboard.press("Escape")
    page.get_by_role("textbox", name="Weather, besides that of each scenario").click()
    page.get_by_role("option", name=re.compile(f"^{WET}")).first.click()
    page.keyboard.press("Escape")
    page.get_by_label("Seeds").fill("3")
    page.get_by_label("Minutes of each run").fill("0.5")
    page.get_by_label("Name").fill("rain")
    page.get_by_role("button", name="Start 6 runs").click()
    expect(page.get_by_role("status").first).to_contain_text(
        "1 scenario × 2 variants × 3 seeds: all runs completed.", timeout=120_000
    )
    page.get_by_role("textbox", name="Figure").click()
    page.get_by_role("option", name="mean speed, km/h").click()
    means = page.get_by_role("table", name="Means")
    found = pl.read_parquet(Workspace.open(served.workspace).studies / "rain" / "results.parquet")
    assert found.height == 6
    designed = found.filter(pl.col("variant") == "as-designed")["mean_speed"].mean()
    assert isinstance(designed, float)
    text = row(means, "as designed").inner_text()
    shown = float(text.split("\t")[-1].split("±")[0])
    assert shown == pytest.approx(3.6 * designed, rel=0.05)
    expect(page.get_by_role("table", name="Differences").get_by_role("row")).to_have_count(2)
    page.get_by_role("link", name="All studies").click()
    listed = page.get_by_role("table", name="Studies").get_by_role("row").last
    expect(listed).to_contain_text("rain")
    expect(listed).to_contain_text("all runs completed")
    page.go_back()
    expect(page.get_by_role("table", name="Means")).to_be_visible()
