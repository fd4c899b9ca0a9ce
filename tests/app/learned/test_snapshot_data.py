"""Snapshots of real runs, training on them, and the evaluation of what comes out."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from odscen.app.generation import generate
from odscen.app.generators import GeneratorDoor
from odscen.app.learned.evaluation import (
    BINNED,
    FLOOR,
    RANDOM,
    REFERENCE,
    evaluate_model,
    evaluate_scenarios,
)
from odscen.app.learned.model_files import kept, train
from odscen.app.learned.snapshot_data import (
    DataSettings,
    make_shards,
    read_shards,
    town_of,
)
from odscen.app.maps import load_map
from odscen.base.errors import InputError
from odscen.learning.reference.model_training import TrainingSettings
from odscen.learning.traffic_snapshots import SignalAhead
from odscen.maps.store import Workspace
from odscen.scenario.sampling.generation_settings import GenerationSettings
from odscen.sumo.realize.signals_ahead import lights_at, lights_at_start

CROSSING = "signal_crossing"
MAPS = Path(__file__).parents[3] / "maps"
SHORT = DataSettings(runs=2, density=(8.0, 12.0), warm_up=30.0, duration=60.0, snapshots=3)


SHORT_ROAD = """<OpenDRIVE><header revMajor="1" revMinor="6"/>
<road id="1" length="10" junction="-1">
<planView><geometry s="0" x="0" y="0" hdg="0" length="10"><line/></geometry></planView>
<lanes><laneSection s="0"><center><lane id="0" type="none"/></center><right>
<lane id="-1" type="driving"><width sOffset="0" a="3.5" b="0" c="0" d="0"/></lane>
</right></laneSection></lanes></road></OpenDRIVE>"""


@pytest.fixture(scope="module")
def workspace(tmp_path_factory: pytest.TempPathFactory) -> Workspace:
    store = Workspace.open(tmp_path_factory.mktemp("learned"))
    store.add_map(MAPS / f"{CROSSING}.xodr")
    return store


@pytest.fixture(scope="module")
def shards(workspace: Workspace, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("shards")
    made = make_shards(workspace, [CROSSING], folder, settings=SHORT)
    assert [one.skipped for one in made] == [None, None]
    return folder


@pytest.mark.slow
def test_lights_show_what_their_program_says_at_each_second(workspace: Workspace) -> None:
    sumo = load_map(workspace.map(CROSSING)).sumo
    start = lights_at_start(sumo)
    lit = start.state != SignalAhead.NONE
    assert lit.any()
    assert set(start.state[lit].tolist()) <= {1, 2, 3}
    light = sumo.lights[0]
    letters = len(light.phases[0].state)
    log = {light.id: [(0.0, "r" * letters), (5.0, "G" * letters), (9.0, "y" * letters)]}
    for time, state, since in ((4.0, 3, 4.0), (6.5, 1, 1.5), (12.0, 2, 3.0)):
        view = lights_at(sumo, log, time)
        assert set(view.state[lit].tolist()) == {state}
        assert set(view.since[lit].tolist()) == {since}


def test_versions_of_one_town_are_one_town() -> None:
    names = ("Town04-2019", "Town04-2020", "carla-2019.Town04", "town_5x5", "2020")
    assert [town_of(one) for one in names] == ["Town04", "Town04", "Town04", "town_5x5", "2020"]


def test_a_run_without_time_for_a_snapshot_is_refused() -> None:
    with pytest.raises(InputError, match="no snapshot after 120 s"):
        DataSettings(duration=121.0)


@pytest.mark.slow(together=True)
def test_snapshots_are_made_once(workspace: Workspace, shards: Path) -> None:
    found = read_shards(shards)
    assert [len(one.snapshots) for one in found] == [3, 3]
    assert {one.town for one in found} == {CROSSING}
    assert sum(len(one.node) for shard in found for one in shard.snapshots) > 20
    before = {file: file.stat().st_mtime_ns for file in shards.iterdir()}
    make_shards(workspace, [CROSSING], shards, settings=SHORT)
    assert {file: file.stat().st_mtime_ns for file in shards.iterdir()} == before


def test_a_map_without_room_for_traffic_is_left_out_with_its_reason(tmp_path: Path) -> None:
    """A road of 20 m; others of the same command are made all the same."""
    store = Workspace.open(tmp_path / "workspace")
    (tmp_path / "short.xodr").write_text(SHORT_ROAD)
    store.add_map(tmp_path / "short.xodr")
    (made,) = make_shards(store, ["short"], tmp_path / "shards", settings=replace(SHORT, runs=1))
    assert (made.vehicles, made.skipped) == (0, "no vehicle came onto the map")


@pytest.mark.slow(together=True)
def test_a_model_is_trained_and_evaluated_beside_baselines(
    workspace: Workspace, shards: Path, tmp_path: Path
) -> None:
    settings = TrainingSettings(epochs=3)
    train(workspace, shards, tmp_path / "one.npz", settings=settings)
    model = train(workspace, shards, tmp_path / "two.npz", settings=settings)
    assert (tmp_path / "one.npz").read_bytes() == (tmp_path / "two.npz").read_bytes()
    found = evaluate_model(
        workspace, read_shards(shards), [], model=model, run=False, most=2, draws=3
    )
    by_source = {one.source: one.values for one in found}
    assert set(by_source) == {FLOOR, REFERENCE, RANDOM}
    assert BINNED not in by_source  # there is no other town to count
    assert by_source[RANDOM]["stopped"].value == 1.0
    assert by_source[REFERENCE]["stopped"].value < 1.0
    assert np.isfinite(by_source[REFERENCE]["frechet"].value)
    low, high = by_source[REFERENCE]["stopped"][1:]
    assert 0.0 <= low <= high <= 1.0
    with pytest.raises(InputError, match="no town 'Town99'"):
        kept(read_shards(shards), ["Town99"])


@pytest.mark.slow(together=True)
def test_scenarios_of_the_shipped_generator_are_measured_and_run(
    workspace: Workspace, shards: Path, tmp_path: Path
) -> None:
    settings = GenerationSettings(map_name=CROSSING, count=2, seed=3, fill=0.4, roi_segments=5)
    paths = generate(
        workspace, settings=settings, out=tmp_path / "made", generator=GeneratorDoor("reference")
    )
    again = generate(
        workspace, settings=settings, out=tmp_path / "again", generator=GeneratorDoor("reference")
    )
    assert [one.read_bytes() for one in paths] == [one.read_bytes() for one in again]
    floor, made = evaluate_scenarios(workspace, tmp_path / "made", read_shards(shards))
    assert (floor.source, made.source) == (FLOOR, "made")
    assert made.scenes == 2
    assert made.vehicles > 3
    assert made.values["inserted"].value == pytest.approx(1.0)
    assert made.values["off_road"].value == 0.0
    assert np.isfinite(made.values["hard_braking"].value)
