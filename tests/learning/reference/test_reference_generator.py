"""The generator that ships: as many vehicles as wanted, apart, and queued at red lights."""

from __future__ import annotations

import io
import json
import re
from pathlib import Path

import numpy as np
import pytest

from odscen.app.learned.learned_maps import whole_map
from odscen.base.categories import DEFAULT_BODY
from odscen.base.errors import InputError
from odscen.learning.fill import VEHICLES, FillRequest, checked_fill
from odscen.learning.reference.gap_states import gap_states
from odscen.learning.reference.reference_generator import (
    WEIGHTS,
    ReferenceGenerator,
    shipped_model,
)
from odscen.learning.reference.traffic_model import (
    VERSION,
    model_bytes,
    model_from_bytes,
    speed_class,
)
from odscen.learning.traffic_snapshots import LightView, SignalAhead, no_lights
from odscen.maps.store import Workspace
from odscen.scenario.document.sampling_config import SamplingConfig
from odscen.scenario.placing.region import Region, Usable
from odscen.scenario.sampling.sampler import wanted_users
from tests.graphs import fork, two_lane_road

GRAPH = two_lane_road(1000.0)
REGION = Region.of(GRAPH, GRAPH.segments.ids)
CREW = wanted_users(REGION, SamplingConfig(), Usable(), fill=0.2)


def request(vehicles: int, lights: LightView | None = None) -> FillRequest:
    allowed = {**CREW.road_places.allowed, **CREW.walk_places.allowed}
    return FillRequest(
        GRAPH, REGION.lanes, REGION.walks, allowed, DEFAULT_BODY, vehicles, 0, 1, lights
    )


def test_the_weights_are_small_and_say_what_they_were_trained_on() -> None:
    data = model_bytes(shipped_model())
    assert len(data) < 1_000_000
    assert shipped_model().about["vehicles"] > 10_000
    assert model_bytes(model_from_bytes(data, file=WEIGHTS)) == data
    with pytest.raises(InputError, match=r"it cannot be read as an \.npz file"):
        model_from_bytes(data[:2000], file="cut.npz")


def test_weights_of_another_version_are_refused_with_both_versions() -> None:
    buffer = io.BytesIO()
    with np.load(io.BytesIO(model_bytes(shipped_model()))) as archive:
        arrays = {name: archive[name] for name in archive.files}
    head = json.loads(str(arrays["about"][0])) | {"version": VERSION - 1}
    np.savez(buffer, allow_pickle=False, **arrays | {"about": np.array([json.dumps(head)])})
    with pytest.raises(InputError, match=f"version is {VERSION - 1}; .* reads {VERSION}"):
        model_from_bytes(buffer.getvalue(), file="old.npz")


def test_weights_whose_statistics_are_no_counts_are_refused() -> None:
    with np.load(io.BytesIO(model_bytes(shipped_model()))) as archive:
        arrays = {name: archive[name] for name in archive.files}
    rate = arrays["statistics_rate"]
    for bad, words in (
        (rate[:-1], r"statistics rate have shape \(143,\), not \(144,\)"),
        (-rate, "statistics rate are no numbers from 0"),
        (np.full_like(rate, np.nan), "statistics rate are no numbers from 0"),
    ):
        buffer = io.BytesIO()
        np.savez(buffer, allow_pickle=False, **arrays | {"statistics_rate": bad})
        with pytest.raises(InputError, match=words):
            model_from_bytes(buffer.getvalue(), file="bad.npz")


@pytest.mark.slow
def test_it_places_about_as_many_as_are_wanted_and_nearly_all_pass_the_check() -> None:
    given = request(24)
    fill = ReferenceGenerator().fill(GRAPH, given, np.random.default_rng(1))
    checked = checked_fill(fill, given, REGION)
    assert 22 <= checked.given <= 24
    assert len(checked.actors) >= 0.95 * checked.given
    assert fill.initial_speed is not None
    assert (fill.initial_speed >= 0).all()


@pytest.mark.slow
def test_the_same_random_numbers_give_the_same_fill() -> None:
    one, two = (
        ReferenceGenerator().fill(GRAPH, request(20), np.random.default_rng(7)) for _ in range(2)
    )
    np.testing.assert_array_equal(one.node, two.node)
    np.testing.assert_array_equal(one.initial_speed, two.initial_speed)


@pytest.mark.slow
def test_more_are_stopped_before_a_red_light_of_a_junction_than_before_a_green_one() -> None:
    graph = fork()
    region = Region.of(graph, graph.segments.ids)
    crew = wanted_users(region, SamplingConfig(), Usable(), fill=0.2)
    allowed = {**crew.road_places.allowed, **crew.walk_places.allowed}
    approach = graph.lanes.lane[0]

    def stopped(state: SignalAhead) -> float:
        lights = no_lights(len(graph.lanes.lanes.keys))
        lights.state[approach], lights.since[approach] = state, 15.0
        given = FillRequest(
            graph, region.lanes, region.walks, allowed, DEFAULT_BODY, 6, 0, 1, lights
        )  # fmt: skip
        slow = []
        for seed in range(30):
            fill = ReferenceGenerator().fill(graph, given, np.random.default_rng(seed))
            assert fill.initial_speed is not None
            slow.append(fill.initial_speed[graph.lanes.lane[fill.node] == approach] < 0.1)
        return float(np.mean(np.concatenate(slow)))

    red, green = stopped(SignalAhead.RED), stopped(SignalAhead.GREEN)
    assert red > 0.2
    assert red > 2.0 * green


def test_a_road_without_a_junction_with_many_vehicles_is_said_to_be_unlike_the_data(
    caplog: pytest.LogCaptureFixture,
) -> None:
    """Vehicles are placed by binned statistics then, as many as are wanted, and move."""
    ReferenceGenerator().fill(GRAPH, request(5), np.random.default_rng(0))
    assert not caplog.records
    for seed in range(3):
        fill = ReferenceGenerator().fill(GRAPH, request(18), np.random.default_rng(seed))
        assert len(fill.node) == 18
        assert fill.initial_speed is not None
        assert (fill.initial_speed > 0.1).mean() >= 0.7
    assert {record.name for record in caplog.records} == {"odscen"}
    times = [float(re.findall(r"traffic ([\d.]+) times", one)[0]) for one in caplog.messages]
    assert times
    assert all(2.7 <= time <= 8.0 for time in times)
    assert all("placed by binned statistics" in words for words in caplog.messages)


@pytest.mark.slow
def test_a_motorway_with_a_merge_and_nothing_else_gets_no_queues_without_a_reason(
    shared_maps: Path, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """In SUMO hardly one vehicle has a stopped one right ahead; the model alone gives it 0.9."""
    store = Workspace.open(tmp_path)
    store.add_map(shared_maps / "esmini" / "highway_merge.xodr")
    on = whole_map(store.map("highway_merge"))
    lights = no_lights(len(on.region.graph.lanes.lanes.keys))
    queues = []
    for seed in range(8):
        given = on.request(30, lights, seed=seed)
        fill = ReferenceGenerator().fill(on.region.graph, given, np.random.default_rng(seed))
        assert len(fill.node) == 30
        assert fill.initial_speed is not None
        names = [str(category) for category in VEHICLES]
        category = np.array([names.index(name) for name in fill.category])
        states = gap_states(
            on.learned.site.strips, node=fill.node, category=category, speed=fill.initial_speed
        )
        queues.append(states.queue[fill.node])
    assert len(caplog.records) >= 6
    assert np.concatenate(queues).mean() < 0.3


def test_nobody_is_placed_where_nobody_is_wanted() -> None:
    fill = ReferenceGenerator().fill(GRAPH, request(0), np.random.default_rng(1))
    assert len(fill.node) == 0


def test_speeds_have_classes_of_a_twentieth_of_the_limit() -> None:
    speeds = np.array([0.0, 0.05, 0.2, 0.5, 10.0, 30.0])
    assert speed_class(speeds, np.full(6, 10.0)).tolist() == [0, 0, 1, 2, 21, 28]
    assert len(VEHICLES) == 6
