from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
from starlette.testclient import TestClient

from odscen.figures.measures.registry import names_of
from tests.own_figure import install

if TYPE_CHECKING:
    from pathlib import Path

    import pytest


def test_the_page_is_told_what_figures_are(client: TestClient) -> None:
    figures = {one["name"]: one for one in client.get("/api/figures").json()}
    assert list(figures) == list(names_of("run"))
    speed = figures["mean_speed"]
    assert (speed["part"], speed["unit"], speed["better"]) == ("figures", "m/s", "higher")
    assert speed["display"] == {"unit": "km/h", "factor": 3.6, "digits": 1, "clock": False}
    assert (figures["arrived"]["part"], figures["sim_seconds"]["part"]) == ("actors", "")
    assert figures["teleported"]["on_page"]


@pytest.mark.slow
def test_figures_of_installed_packages_are_offered_to_the_page(
    client: TestClient, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert client.get("/api/figures/installed").json() == []
    install(tmp_path, monkeypatch)
    rows = {row["name"]: row for row in client.get("/api/figures/installed").json()}
    assert rows["top_speed"]["definition"] == "Highest speed that anybody had, m/s."
    assert rows["gone"]["error"]
