from __future__ import annotations

from pathlib import Path

import pytest

from odscen.app.map_comparison import ComparisonSettings, compare_converters
from odscen.app.networks import bring_in
from odscen.base.errors import InputError, NotFoundError
from odscen.maps.store import Workspace

MAPS = Path(__file__).parents[2] / "maps"
NO_RUNS = ComparisonSettings(levels=())


@pytest.fixture
def place(tmp_path: Path) -> Workspace:
    return Workspace.open(tmp_path / "workspace")


@pytest.mark.slow
def test_the_same_trips_run_on_both_networks_and_the_map_stays_as_it_is(place: Workspace) -> None:
    before = place.add_map(MAPS / "signal_crossing.xodr")
    settings = ComparisonSettings(levels=(300.0,), seeds=(1, 2), duration=300.0)
    found = compare_converters(place, "signal_crossing", settings=settings)
    assert [one.converter for one in found.networks] == ["odscen", "netconvert"]
    (row,) = found.capacity
    own, peer = row.networks["odscen"], row.networks["netconvert"]
    assert own.planned == peer.planned == pytest.approx(300.0 * found.kilometres / 12.0, rel=0.4)
    for carried in (own, peer):
        assert carried.arrived == carried.planned
        assert carried.teleported == 0
        assert 0.0 < carried.delay < 60.0
    assert place.map("signal_crossing") == before
    assert place.map_names() == ["signal_crossing"]


@pytest.mark.slow
def test_what_each_lost_is_measured_on_the_same_map(place: Workspace) -> None:
    place.add_map(MAPS / "t_junction_signs.xodr")
    data = compare_converters(place, "t_junction_signs", settings=NO_RUNS).to_dict()
    own, peer = data["networks"]
    values = [{v["name"]: v["value"] for v in one["fidelity"]} for one in (own, peer)]
    assert [one["crosswalks lost"] for one in values] == [0, 6]
    assert (
        values[0]["lanes in junctions, 99 %, m"] < 0.05 < values[1]["lanes in junctions, 99 %, m"]
    )
    signs = [one for one in peer["lost"] if "sign: netconvert does not read it" in one["reason"]]
    assert len(signs) == 2
    assert not [one for one in own["lost"] if "sign" in one["reason"]]
    assert data["capacity"] == []


@pytest.mark.slow
def test_a_map_that_netconvert_refuses_is_compared_with_its_reason(
    place: Workspace, tmp_path: Path
) -> None:
    strange = tmp_path / "strange.xodr"
    text = (MAPS / "signal_crossing.xodr").read_text()
    strange.write_text(text.replace('type="1000001"', 'type=""'))
    place.add_map(strange)
    settings = ComparisonSettings(levels=(100.0,), duration=60.0)
    found = compare_converters(place, "strange", settings=settings)
    own, peer = found.networks
    assert own.refused is None
    assert peer.refused is not None
    assert "Attribute 'type' in definition of signal" in peer.refused
    assert list(found.capacity[0].networks) == ["odscen"]


@pytest.mark.slow
def test_a_network_that_was_brought_in_is_compared_too(place: Workspace, tmp_path: Path) -> None:
    net = place.add_map(MAPS / "signal_crossing.xodr").path("net")
    file = tmp_path / "mine.net.xml"
    file.write_bytes(net.read_bytes())
    bring_in(place, "signal_crossing", file)
    found = compare_converters(place, "signal_crossing", settings=NO_RUNS)
    assert [one.converter for one in found.networks] == ["odscen", "netconvert", "file"]
    own, _, mine = (one.fidelity for one in found.networks)
    assert own == mine


@pytest.mark.parametrize(
    ("levels", "seeds", "duration", "reason"),
    [
        ((0.0,), (1,), 900.0, "a level must be above 0"),
        ((100.0,), (1,), 1.0, "duration must be 60 to 86,400 s"),
        ((100.0,), (), 900.0, "needs a seed"),
    ],
)
def test_settings_that_make_no_sense_are_refused(
    levels: tuple[float, ...], seeds: tuple[int, ...], duration: float, reason: str
) -> None:
    with pytest.raises(InputError, match=reason):
        ComparisonSettings(levels=levels, seeds=seeds, duration=duration)


def test_a_map_that_is_not_there_is_named(place: Workspace) -> None:
    with pytest.raises(NotFoundError):
        compare_converters(place, "nowhere", settings=NO_RUNS)
