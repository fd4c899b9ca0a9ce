"""The self-check against a stand-in that does as a real server is said to, and one that errs."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from odscen.base.errors import InputError
from odscen.carla.selfcheck.check_line import CheckLimits, CheckLine, CheckState, SelfcheckReport
from odscen.carla.selfcheck.selfcheck_page import selfcheck_data, selfcheck_page
from odscen.carla.selfcheck.selfcheck_run import selfcheck
from odscen.carla.server.client import Address
from odscen.carla.server.protocol_recording import recorded_protocol
from odscen.cli.commands import command_line
from odscen.maps.store import Workspace
from tests.carla.conftest import MAPS
from tests.carla_standin.process import Replay, StandIn

carla = pytest.importorskip("carla", reason="co-simulation needs the package carla")

CROSSING = MAPS / "signal_crossing.xodr"
PATIENT = CheckLimits(pace=2.0, ground_ms=200.0)
"""The machine of a test may be busy."""
WRONG = {
    "seconds of a tick": "0.1000 to 0.1000 s",
    "ground below places": "found at 0 of 10 places",
    "height at which a car is made": "refused at 0, 0.05, 0.1, 0.15, 0.2, 0.3",
    "height at which a walker is made": "refused at 0, 0.05, 0.1, 0.15, 0.2, 0.3",
    "place of a car": "0.1000 m, ",
    "height of a car": "+0.2000 m",
    "pitch of a car": "0.000 degrees",
    "speed reported without physics": "3.00 m/s",
    "lights of a car": "0",
    "place with --sensed-speed": "0.2236 m off, of that +0.2000 m up",
    "speed with --sensed-speed": "5.00 m/s",
    "feet of a walker": "-0.",
    "walk of a walker": "0.07",
    "traffic lights of the map": "6 of 8; without one: ",
    "state of the traffic lights": "wrong: ",
    "ticks with 100 actors": "100 actors, ",
    "answers about the ground": " ms",
    "given back": "traffic lights frozen or not, ",
}
"""Part of what is seen in each line by the switches of the test below."""


def address_of(server: StandIn) -> Address:
    return Address(server.host, server.port, 10.0)


def by_name(report: SelfcheckReport) -> dict[str, CheckLine]:
    return {line.name: line for line in report.lines}


@contextmanager
def own_world(server: StandIn) -> Iterator[Any]:
    """Another client's world, with a car in it."""
    client = carla.Client(server.host, server.port)
    client.set_timeout(5.0)
    world = client.get_world()
    blueprint = world.get_blueprint_library().find("vehicle.audi.tt")
    world.spawn_actor(blueprint, carla.Transform(carla.Location(200.0, 200.0, 50.0)))
    yield world


@pytest.mark.slow
def test_a_server_that_does_as_expected_passes_every_check_and_is_as_it_was(
    workspace: Workspace, tmp_path: Path
) -> None:
    """And what was said is enough to check it again without the server."""
    transcript = tmp_path / "selfcheck.jsonl.gz"
    workspace.add_map(CROSSING)
    with StandIn(CROSSING, kerb=0.1) as server, own_world(server) as world:
        weather, loaded = world.get_weather(), server.calls()["load_new_episode"]
        shown: list[str] = []
        with recorded_protocol(address_of(server), transcript) as address:
            report = selfcheck(
                workspace,
                address,
                limits=PATIENT,
                notify=lambda what, _share: shown.append(what),
            )
        assert report.server == str(address_of(server))
        kinds = [a["type_id"] for a in server.actors() if a["type_id"].startswith("vehicle.")]
        assert kinds == ["vehicle.audi.tt"]
        assert world.get_weather() == weather
        assert not world.get_settings().synchronous_mode
        assert server.calls()["load_new_episode"] == loaded
    assert {line.name: line.seen for line in report.lines if line.state != CheckState.OK} == {}
    assert len(report.lines) == 21
    lines = by_name(report)
    assert lines["map"].seen == "signal_crossing: the same text"
    assert lines["frames of a tick"].seen == "1"
    assert lines["height at which a car is made"].seen.startswith("refused at 0, 0.05, 0.1 m; ")
    assert lines["feet of a walker"].seen in ("+0.000 m", "-0.000 m")
    assert lines["speed with --sensed-speed"].seen == "10.00 m/s"
    assert lines["traffic lights of the map"].seen == "8 of 8"
    assert shown[0] == "release"
    with Replay(transcript) as replay:
        again = selfcheck(workspace, address_of(replay), limits=PATIENT)
        outcome = replay.outcome()
    assert (outcome["differences"], outcome["left"]) == ([], [])
    timed = ("ticks with 100 actors", "answers about the ground")
    kept = [line for line in report.lines if line.name not in timed]
    assert [line for line in again.lines if line.name not in timed] == kept


@pytest.mark.slow
def test_each_line_says_what_a_server_does_that_does_otherwise(workspace: Workspace) -> None:
    workspace.add_map(MAPS / "roundabout.xodr")
    with StandIn(
        CROSSING, map_name="roundabout", time_factor=2.0, blind_ground=True, least_lift=0.5,
        place_error=0.2, place_aside=0.1, drops_pitch=True, still_speed=3.0, deaf_lamps=True,
        speed_factor=0.5, half_capsule=False, walkers_drift=True, nameless_lights=2,
        late_calls="tick", tick_seconds=0.06, ground_seconds=0.02, keeps_actors=True,
    ) as server:  # fmt: skip
        report = selfcheck(workspace, address_of(server), limits=CheckLimits(ground_ms=15.0))
    lines = by_name(report)
    assert lines["map"].seen == "roundabout: other roads"
    for name, words in WRONG.items():
        assert words in lines[name].seen, name
        assert lines[name].state == CheckState.DIFFERS, name
    assert "actors more" in lines["given back"].seen
    as_expected = {line.name for line in report.lines if line.state == CheckState.OK}
    assert as_expected == {"release", "frames of a tick"}, "tested below"


@pytest.mark.slow
def test_nothing_more_is_checked_where_others_tick_as_well(workspace: Workspace) -> None:
    with StandIn(CROSSING, frames_per_tick=2) as server:
        report = selfcheck(workspace, address_of(server))
    lines = by_name(report)
    assert lines["frames of a tick"].seen == "2"
    assert [line.name for line in report.differing] == ["frames of a tick"]
    assert lines["feet of a walker"].note == "the ticks are not ours alone"
    assert lines["given back"].state == CheckState.OK


@pytest.mark.slow
def test_an_interrupted_check_gives_the_server_back(workspace: Workspace) -> None:
    def stop(_what: str, _share: float) -> None:
        os.kill(os.getpid(), signal.SIGINT)

    with StandIn(CROSSING) as server:
        report = selfcheck(workspace, address_of(server), notify=stop)
    assert report.interrupted
    assert {line.note for line in report.unchecked} == {"interrupted"}
    assert by_name(report)["given back"].seen == "as before"


@pytest.mark.slow
def test_another_release_is_the_only_line(workspace: Workspace) -> None:
    with StandIn(CROSSING, version="0.9.15") as server:
        report = selfcheck(workspace, address_of(server))
        assert set(server.calls()) == {"version"}
    assert [line.name for line in report.differing] == ["release"]
    assert "0.9.15" in report.differing[0].seen
    assert len(report.unchecked) == 20


@pytest.mark.slow
def test_the_page_and_the_data_have_every_line(tmp_path: Path, workspace: Workspace) -> None:
    with StandIn(CROSSING, frames_per_tick=2, version="0.9.16-dirty") as server:
        done = subprocess.run(
            [
                sys.executable, "-m", "odscen", "cosim", "--selfcheck", "--json", "--carla",
                f"{server.host}:{server.port}", "--out", tmp_path, "--workspace", workspace.root,
            ],
            capture_output=True, text=True, check=False,
        )  # fmt: skip
    assert done.returncode == 1
    printed = json.loads(done.stdout)
    page = Path(printed["files"]["page"]).read_text(encoding="utf-8")
    data = json.loads(Path(printed["files"]["data"]).read_text(encoding="utf-8"))
    assert data == {key: value for key, value in printed.items() if key != "files"}
    assert (data["ok"], data["versions"]["server"]) == (False, "0.9.16-dirty")
    assert len(data["checks"]) == 21
    assert "1 of 21 checks differ" in page
    for check in data["checks"]:
        assert f">{check['name']}<" in page


def test_words_of_a_server_are_shown_as_words() -> None:
    line = CheckLine("map", "a", "<script>alert(1)</script>", CheckState.DIFFERS)
    report = SelfcheckReport("box:2000", {"carla": "0.9.16"}, "x", [line])
    assert "<script>alert" not in selfcheck_page(report)
    assert selfcheck_data(report)["checks"][0]["seen"] == line.seen


def test_cosim_without_a_scenario_says_what_to_name() -> None:
    done = CliRunner().invoke(command_line(), ["cosim"])
    assert isinstance(done.exception, InputError)
    assert "no scenario is named" in str(done.exception)
