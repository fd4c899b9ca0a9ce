"""What the page colours lanes with, compared with the files of the run."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import polars as pl
import pytest
from starlette.testclient import TestClient

from odscen.app.maps import load_map
from odscen.figures.by_place.lane_places import LanePlaces
from odscen.maps.store import Workspace
from odscen.runs.run_sums import seal_again
from tests.web.conftest import CROSSING, finished
from tests.web.test_runs import start

SUMS = ("distance", "seconds", "time_loss")


@pytest.fixture
def run(client: TestClient, sampled: str) -> str:
    name = start(client, sampled, until=60)
    assert finished(client, name)["state"] == "completed"
    return name


@pytest.mark.slow
def test_sums_of_lanes_are_those_of_the_run_and_make_the_figures_of_its_tables(
    client: TestClient, workspace: Workspace, run: str
) -> None:
    folder = workspace.runs / run
    columns = client.get(f"/api/runs/{run}/lanes").json()
    lanes = pl.read_parquet(folder / "lanes.parquet").filter(pl.col("seconds") > 0)
    places = LanePlaces.from_json((folder / "lane_places.json").read_text())
    lanes = lanes.join(places.lanes.unique("lane"), on="lane").sort("begin", "lane")
    rows = np.diff(columns["first"])
    begins = np.repeat(columns["times"][:-1], rows)
    assert begins.tolist() == lanes["begin"].to_list()
    assert len(rows) > 3
    for name in SUMS:
        assert columns[name] == pytest.approx(lanes[name].to_list(), abs=1e-3)
    lengths = np.array(columns["lengths"])[columns["lane"]]
    assert lengths == pytest.approx(lanes["length"].to_numpy(), abs=1e-3)
    network = pl.read_csv(folder / "figures" / "network.csv")
    for (low, high), speed in zip(
        pairwise(columns["first"]), network["speed"].to_list(), strict=True
    ):
        driven, spent = (sum(columns[name][low:high]) for name in ("distance", "seconds"))
        assert driven / spent == pytest.approx(speed, rel=1e-4)


def test_nodes_of_the_graph_lie_on_the_lanes_that_vehicles_drove_on(
    client: TestClient, workspace: Workspace, run: str
) -> None:
    columns = client.get(f"/api/runs/{run}/lanes").json()
    places = load_map(workspace.map(CROSSING)).sumo.lane_places
    seen = pl.read_parquet(workspace.runs / run / "lanes.parquet").filter(pl.col("seconds") > 0)
    driven = sorted(set(seen["lane"]))
    covered: set[int] = set()
    for first, end, lane in zip(
        *(columns[f"node_{name}"] for name in ("first", "end", "lane")), strict=True
    ):
        names = {places.lanes[places.lane[node]] for node in range(first, end)}
        assert len(names) == 1
        assert names.pop() in driven
        assert lane < len(columns["lengths"])
        covered |= set(range(first, end))
    on_driven = {n for n, row in enumerate(places.lane) if row >= 0 and places.lanes[row] in driven}
    assert covered == on_driven


@pytest.mark.slow
def test_the_answer_is_not_sent_twice(client: TestClient, run: str) -> None:
    first = client.get(f"/api/runs/{run}/lanes")
    again = client.get(f"/api/runs/{run}/lanes", headers={"If-None-Match": first.headers["etag"]})
    assert (again.status_code, again.content) == (304, b"")


@pytest.mark.slow
def test_a_run_without_lane_data_is_refused_in_words(
    client: TestClient, workspace: Workspace, run: str
) -> None:
    (workspace.runs / run / "lanes.parquet").unlink()
    seal_again(workspace.runs / run)
    answer = client.get(f"/api/runs/{run}/lanes")
    assert answer.status_code == 422
    assert "no lane data" in answer.json()["error"]["message"]
