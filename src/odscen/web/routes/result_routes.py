"""Routes for what a run has left: its files, and how well it meets counts of vehicles."""

from __future__ import annotations

from pathlib import PurePosixPath
from typing import Any

import numpy as np
import orjson
from fastapi import APIRouter
from starlette.requests import Request
from starlette.responses import FileResponse, Response

from odscen.app.demand import demands
from odscen.app.running.run_lanes import TrafficOnMap, traffic_on_map
from odscen.app.scenarios import read_scenario
from odscen.runs.layout import SCENARIO_FILE
from odscen.scenario.demand.count_stations import place_points
from odscen.web.packed import UNCHANGED, answer, pack
from odscen.web.services import Shared
from odscen.web.wire.media_types import ANY_FILE
from odscen.web.wire.run_messages import FitRow, RunFile, RunFit, RunLanes

router = APIRouter(prefix="/api/runs/{run}")


@router.get("/files")
def files(run: str, shared: Shared) -> list[RunFile]:
    """Files that can be downloaded: report, figures, tables, recordings."""
    return shared.runs.kept.files(run)


@router.get("/files/{name:path}", response_class=Response, responses=ANY_FILE)
def file(run: str, name: str, shared: Shared) -> Response:
    """Download one of them."""
    path = shared.runs.kept.file(run, name)
    kind = "application/vnd.apache.parquet" if path.suffix == ".parquet" else None
    return FileResponse(path, filename=f"{run}-{PurePosixPath(name).name}", media_type=kind)


@router.get("/fit")
def fit(run: str, shared: Shared) -> RunFit:
    """How well a finished run meets the counts of its scenario."""
    folder = shared.runs.kept.whole(run)
    fit_report = demands.fit_counts(shared.workspace, folder)
    scenario = read_scenario(folder / SCENARIO_FILE)
    graph = shared.map_of(scenario).sumo.graph
    points = place_points(graph, [row.place for row in fit_report.rows])
    rows = []
    for row in fit_report.rows:
        x, y = points.get(row.place, (None, None))
        rows.append(FitRow(**row._asdict(), met=row.met, x=x, y=y))
    return RunFit(
        rows=rows,
        met=sum(row.met for row in fit_report.rows),
        hours=len(fit_report.hours),
        hours_met=sum(hour.met for hour in fit_report.hours),
        rmse=fit_report.rmse,
        contradictions=list(fit_report.contradictions),
    )


@router.get("/lanes", response_model=RunLanes, responses=UNCHANGED)
def lanes(run: str, request: Request, shared: Shared) -> Response:
    """What vehicles did on each lane in each interval of a finished run, as columns."""
    found = _lane_columns(traffic_on_map(shared.workspace, shared.runs.kept.whole(run)))
    return answer(request, pack(orjson.dumps(found, option=orjson.OPT_SERIALIZE_NUMPY)))


def _lane_columns(found: TrafficOnMap) -> dict[str, Any]:
    """As :class:`RunLanes`: metres and seconds to three digits."""
    traffic, stretches = found
    sums = traffic.sums
    intervals = np.arange(len(traffic.times))
    return {
        "times": traffic.times,
        "first": np.searchsorted(sums["interval"].to_numpy(), intervals),
        "lane": sums["lane"].to_numpy(),
        **{name: sums[name].round(3).to_numpy() for name in ("distance", "seconds", "time_loss")},
        "lengths": [round(length, 3) for length in traffic.lengths],
        "node_first": stretches.first,
        "node_end": stretches.end,
        "node_lane": stretches.lane,
    }
