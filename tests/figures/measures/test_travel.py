from __future__ import annotations

import json

import numpy as np
import pytest

from odscen.figures.measures.figure import RunData, SummaryPart
from odscen.figures.measures.registry import figure_values
from odscen.figures.measures.summary import Trip, actor_outcomes
from odscen.records.run_events import Event, EventKind
from tests.figures.measures.test_summary import EVENTS, plan, planned


def test_counts_add_up_and_count_actors_not_events() -> None:
    outcomes = actor_outcomes(plan(planned("a"), planned("b"), planned("c")), EVENTS)
    counts = figure_values(RunData(outcomes), part=SummaryPart.ACTORS)
    assert counts == {
        "planned": 3, "inserted": 2, "arrived": 1, "running": 1, "waiting": 1, "stranded": 0,
        "teleported": 1, "collided": 2, "emergency_stopped": 1,
    }  # fmt: skip


def test_figures_keep_vehicles_and_pedestrians_apart() -> None:
    actors = [planned(f"v{i}") for i in range(5)] + [
        planned("p", category="pedestrian", route_length=13.0, free_flow_time=10.0)
    ]
    arrivals = tuple(
        Event(10.0 + i, EventKind.ARRIVED, actor.id, travel_time=10.0 + i)
        for i, actor in enumerate(actors)
    )
    trips = {actor.id: Trip(i, 2.0 * i, i) for i, actor in enumerate(actors[:5])}
    trips["p"] = Trip(0.5, 7.0, None)
    figures = figure_values(RunData(actor_outcomes(plan(*actors), arrivals, trips)))
    assert figures["mean_travel_time"] == 12.0
    assert figures["median_travel_time"] == 12.0
    assert figures["p95_travel_time"] == pytest.approx(np.percentile([10, 11, 12, 13, 14], 95))
    assert figures["mean_speed"] == pytest.approx(500 / 60, abs=1e-6)
    assert (figures["mean_delay"], figures["mean_waiting_time"]) == (2.0, 4.0)
    assert figures["mean_stops"] == 2.0
    assert figures["pedestrian_mean_delay"] == 0.5
    assert figures["pedestrian_mean_waiting_time"] == 7.0
    assert figures["pedestrian_mean_travel_time"] == 15.0
    assert figures["pedestrian_mean_speed"] == pytest.approx(13 / 15, abs=1e-6)


def test_figures_of_nobody_are_none_and_still_json() -> None:
    figures = figure_values(RunData())
    assert set(figures.values()) == {None}
    json.dumps(figures, allow_nan=False)
