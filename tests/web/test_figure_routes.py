from __future__ import annotations

from starlette.testclient import TestClient

from odscen.results.measures.registry import names_of


def test_the_page_is_told_what_figures_are(client: TestClient) -> None:
    figures = {one["name"]: one for one in client.get("/api/figures").json()}
    assert list(figures) == list(names_of("run"))
    speed = figures["mean_speed"]
    assert (speed["part"], speed["unit"], speed["better"]) == ("figures", "m/s", "higher")
    assert speed["display"] == {"unit": "km/h", "factor": 3.6, "digits": 1, "clock": False}
    assert (figures["arrived"]["part"], figures["sim_seconds"]["part"]) == ("actors", "")
    assert figures["teleported"]["on_page"]
