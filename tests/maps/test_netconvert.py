from __future__ import annotations

import sys
from pathlib import Path

import pytest

from odscen.base.errors import MissingDependencyError, ToolError
from odscen.convert.imported.net_import import read_network
from odscen.maps import netconvert
from odscen.maps.netconvert import NetconvertLimits, convert_map, run_netconvert
from tests.opendrive.snippets import document, road

ENOUGH = NetconvertLimits(20.0, 1 << 30)
MAPS = Path(__file__).parents[2] / "maps"


def run(text: str, limits: NetconvertLimits = ENOUGH) -> bytes:
    done = run_netconvert(
        ["--opendrive-files=m.xodr"], files={"m.xodr": text.encode()}, limits=limits
    )
    return done.net_xml


def test_a_road_becomes_a_network() -> None:
    assert read_network(run(document(road()))).counts()["edges"] == 2


def test_the_network_does_not_say_when_or_where_it_was_made() -> None:
    one, other = run(document(road())), run(document(road()))
    assert one == other
    assert b"generated on" not in one


def test_a_map_is_converted_by_the_first_step_of_the_recipe_with_its_limits() -> None:
    net_xml, entries = convert_map((MAPS / "town_5x5.xodr").read_bytes(), lefthand=False)
    net = read_network(net_xml)
    assert net.counts()["crossings"] == 112
    speeds = {
        round(lane.speed * 3.6)
        for lane in net.lanes.values()
        if lane.allows("bus") and net.function(lane.id) == "normal"
    }
    assert speeds == {30, 50}
    given_up = [one for one in entries if one.element == "netconvert" and one.outcome == "lost"]
    assert not given_up


def test_what_netconvert_warns_of_is_in_the_report() -> None:
    _, entries = convert_map((MAPS / "rural_hills.xodr").read_bytes(), lefthand=False)
    assert any("is not connected from any incoming edge" in entry.reason for entry in entries)


def test_a_refusal_ends_with_netconverts_own_words() -> None:
    with pytest.raises(ToolError, match="refused the map") as caught:
        run(document(road()).replace('length="100.0"', 'length="x"'))
    assert "length" in caught.value.output


def test_a_map_that_no_step_takes_is_refused() -> None:
    text = document(road()).replace('length="100.0"', 'length="x"')
    with pytest.raises(ToolError, match="refused the map"):
        convert_map(text.encode(), lefthand=False)


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux limits a running child")
def test_too_little_memory_is_an_error_and_not_a_hang() -> None:
    with pytest.raises(ToolError):
        run(document(road()), NetconvertLimits(20.0, 8 << 20))


def fake(folder: Path, script: str) -> Path:
    program = folder / "fake"
    program.write_text(f"#!{sys.executable}\n{script}\n")
    program.chmod(0o755)
    return program


@pytest.mark.slow
@pytest.mark.parametrize(
    ("script", "problem"),
    [
        ("import os, signal; os.kill(os.getpid(), signal.SIGSEGV)", r"crashed \(SIGSEGV\)"),
        ("print('std::bad_alloc'); raise SystemExit(1)", "1024 MiB of memory"),
        ("import time; time.sleep(60)", "did not finish within 1 s"),
        ("print('Error: no'); raise SystemExit(3)", r"exit code 3(.|\n)*Error: no"),
        ("pass", "refused the map"),
    ],
)
@pytest.mark.skipif(sys.platform == "win32", reason="needs a script that runs by itself")
def test_every_way_to_fail_says_what_happened(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, script: str, problem: str
) -> None:
    program = fake(tmp_path, script)
    monkeypatch.setattr(netconvert, "_find_program", lambda: (program, {}))
    with pytest.raises(ToolError, match=problem):
        run_netconvert([], files={}, limits=NetconvertLimits(0.1, 1 << 30))


def test_without_sumo_the_error_says_how_to_get_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "sumo", None)
    with pytest.raises(MissingDependencyError, match="pip install"):
        run(document(road()))
