"""A mirrored run that was recorded is a test for ever: the same calls, or the first that differs.

What is recorded here comes from the stand-in; of a real server it would be the same file.
"""

from __future__ import annotations

import itertools
import json
from pathlib import Path
from typing import Any

import pytest

from odscen.base.errors import InputError, WorkspaceError
from odscen.carla.mirror.cosim import cosim
from odscen.carla.mirror.cosim_options import CosimOptions
from odscen.carla.server.client import Address
from odscen.carla.server.protocol_recording import recorded_protocol
from odscen.carla.server.recording_proxy import (
    FrameKind,
    frame_line,
    header_line,
    parse_transcript,
)
from odscen.maps.store import Workspace
from odscen.runs.run_settings import RunSettings
from tests.carla.conftest import MAPS, Sample, hero_pose, scenario_of
from tests.carla.driver import Car, Driver
from tests.carla_standin.process import Replay, StandIn
from tests.carla_standin.replay import read

carla = pytest.importorskip("carla", reason="co-simulation needs the package carla")

CROSSING, WEAVE = MAPS / "signal_crossing.xodr", MAPS / "motorway_weave.xodr"


def mirrored(
    workspace: Workspace, path: Path, address: Address, out: Path, **options: Any
) -> tuple[Path, dict[str, Any]]:
    """Folder of a run of two seconds, and what its report says of the server."""
    result, report = cosim(
        workspace,
        path,
        CosimOptions(address, tick=0.1, **options),
        out=out,
        settings=RunSettings(until=2.0, step_length=0.1),
    )
    assert (result.status, report.error, report.left_behind) == ("completed", None, [])
    return result.folder, {"spawned": report.spawned, "ticks": report.ticks, "map": report.map}


@pytest.fixture(scope="module")
def recorded(
    workspace: Workspace, sample: Sample, tmp_path_factory: pytest.TempPathFactory
) -> tuple[Path, Path, Path, dict[str, Any]]:
    """Scenario, transcript, run folder and report of a run on the stand-in."""
    out = tmp_path_factory.mktemp("recorded")
    path, transcript = sample(CROSSING, seed=1), out / "run.jsonl.gz"
    with StandIn(CROSSING) as server:
        origin = Address(server.host, server.port)
        with recorded_protocol(origin, transcript) as address:
            assert str(address) == str(origin)
            folder, told = mirrored(workspace, path, address, out)
    return path, transcript, folder, told


@pytest.mark.slow
def test_the_transcript_has_calls_their_answers_and_the_states_of_the_world(
    recorded: tuple[Path, Path, Path, dict[str, Any]],
) -> None:
    frames = read(recorded[1])
    calls = [frame for frame in frames if frame.kind is FrameKind.CALL]
    answers = {frame.number: frame.name for frame in frames if frame.kind is FrameKind.ANSWER}
    assert [frame.number for frame in calls] == list(range(1, len(calls) + 1))
    assert answers == {frame.number: frame.name for frame in calls}
    assert all(a.at <= b.at for a, b in itertools.pairwise(frames))
    ticks = [frame for frame in calls if frame.name == "tick_cue"]
    states = [frame.number for frame in frames if frame.kind is FrameKind.STATE]
    assert len(states) >= len(ticks) >= recorded[3]["ticks"] == 20
    assert len(set(states)) == len(states)


@pytest.mark.slow
def test_a_run_against_its_recording_makes_the_same_calls_and_comes_to_the_same(
    workspace: Workspace, recorded: tuple[Path, Path, Path, dict[str, Any]], tmp_path: Path
) -> None:
    path, transcript, before, told = recorded
    with Replay(transcript) as server:
        folder, again = mirrored(workspace, path, Address(server.host, server.port), tmp_path)
        outcome = server.outcome()
    assert outcome["differences"] == []
    assert outcome["left"] == []
    assert outcome["made"] > 60
    assert again == told
    for name in ("trajectories.parquet", "parity.parquet", "parity_lights.parquet"):
        assert (folder / name).read_bytes() == (before / name).read_bytes(), name


@pytest.mark.slow
def test_a_run_by_another_clients_clock_can_be_replayed_as_well(
    workspace: Workspace, tmp_path: Path
) -> None:
    """Which tick each call comes behind is in the recording, however fast the replay is."""
    actor = {"id": "a", "category": "car", "spawn": "2.1.-1.40", "goal": "4.1.-1.200", "ego": True}
    path = scenario_of(workspace, WEAVE, [actor], tmp_path)
    transcript = tmp_path / "run.jsonl.gz"
    parked = Car(hero_pose(workspace, WEAVE, "36.0.-1.40"), [(0.0, 0.0)])

    def followed(address: Address, name: str) -> tuple[Path, int]:
        (tmp_path / name).mkdir()
        result, report = cosim(
            workspace,
            path,
            CosimOptions(address, follow=True),
            out=tmp_path / name,
            settings=RunSettings(until=2.0, step_length=0.5),
        )
        assert (result.status, report.error, report.spawned) == ("completed", None, 1)
        return result.folder, report.ticks

    with (
        StandIn(WEAVE, map_name=WEAVE.stem, refuse_grounded=False) as server,
        Driver(server, parked, led=0.1),
        recorded_protocol(Address(server.host, server.port, 30.0), transcript) as address,
    ):
        before, ticks = followed(address, "recorded")
    assert not [frame for frame in read(transcript) if frame.name == "tick_cue"]
    with Replay(transcript) as replay:
        folder, again = followed(Address(replay.host, replay.port, 30.0), "replayed")
        outcome = replay.outcome()
    assert (outcome["differences"], outcome["left"], again) == ([], [], ticks)
    assert outcome["made"] > 60
    for name in ("trajectories.parquet", "parity.parquet"):
        assert (folder / name).read_bytes() == (before / name).read_bytes(), name


@pytest.mark.slow
def test_a_call_that_has_changed_is_named(
    workspace: Workspace, recorded: tuple[Path, Path, Path, dict[str, Any]], tmp_path: Path
) -> None:
    path, transcript, _, _ = recorded
    scenario = json.loads(path.read_text())
    scenario["environment"] = {**scenario.get("environment", {}), "preset": "HardRainNight"}
    night = tmp_path / "night.scenario.json"
    night.write_text(json.dumps(scenario))
    with Replay(transcript) as server:
        mirrored(workspace, night, Address(server.host, server.port), tmp_path)
        differences = server.outcome()["differences"]
    assert ", set_weather_parameters[1][0]: " in differences[0]
    lights = [words for words in differences if "SpawnActor" in words]
    assert "apply_batch command " in lights[0]
    assert lights[0].endswith(": 0 recorded, 3 now"), "position lights and low beam"


@pytest.mark.parametrize(
    ("text", "where"),
    [
        ("no", "line 1"),
        ('{"format": "odscen-carla-protocol", "version": 9}\n', "version 9"),
        ('{"format": "odscen-carla-protocol", "version": 1}\n{"at": 1}\n', "line 2"),
    ],
)
def test_what_is_no_transcript_is_refused_with_the_line(text: str, where: str) -> None:
    with pytest.raises(InputError, match=where):
        parse_transcript(text.splitlines(keepends=True), file="run.jsonl")


def test_a_last_line_that_was_cut_is_left_out(
    recorded: tuple[Path, Path, Path, dict[str, Any]],
) -> None:
    frames = read(recorded[1])
    lines = [header_line(), *map(frame_line, frames[:3])]
    lines[-1] = lines[-1][:-20]
    assert parse_transcript(lines, file="run.jsonl") == frames[:2]


@pytest.mark.slow
def test_a_recording_that_cannot_be_written_is_refused_before_anything_is_said(
    tmp_path: Path,
) -> None:
    nowhere = tmp_path / "none" / "run.jsonl"
    with StandIn(CROSSING) as server:
        address = Address(server.host, server.port)
        with (
            pytest.raises(WorkspaceError, match=r"run\.jsonl: the protocol cannot be recorded: No"),
            recorded_protocol(address, nowhere),
        ):
            pass
        assert not server.calls()
