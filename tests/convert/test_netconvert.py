from __future__ import annotations

import sys
from typing import TYPE_CHECKING

import pytest

from odscen.convert import netconvert
from odscen.convert.net import Net
from odscen.convert.netconvert import netconvert_path, read_map, run_netconvert, stage
from odscen.errors import InputError, MissingDependencyError, NetconvertError, WorkspaceError
from tests.opendrive.snippets import document, road

if TYPE_CHECKING:
    from pathlib import Path

MEGABYTE = 1 << 20


def run(folder: Path, text: str, *options: str, memory: int = 1024 * MEGABYTE) -> bytes:
    path = stage(folder, {"m.xodr": text.encode()}) / "m.xodr"
    result = run_netconvert(path, options, time_limit=20.0, memory_limit=memory)
    return result.net_xml


def test_a_road_becomes_a_network(tmp_path: Path) -> None:
    net = Net.parse(run(tmp_path, document(road())))
    assert net.counts()["edges"] == 2


def test_the_network_does_not_say_when_or_where_it_was_made(tmp_path: Path) -> None:
    text = document(road())
    folders = [tmp_path / name for name in ("a", "b")]
    for folder in folders:
        folder.mkdir()
    one, other = (run(folder, text) for folder in folders)
    assert one == other
    assert b"generated on" not in one
    assert str(tmp_path).encode() not in one


def test_a_folder_with_spaces_and_commas_does_no_harm(tmp_path: Path) -> None:
    folder = tmp_path / "a, b c"
    folder.mkdir()
    assert Net.parse(run(folder, document(road()))).counts()["edges"] == 2


def test_a_refusal_ends_with_netconverts_own_words(tmp_path: Path) -> None:
    with pytest.raises(NetconvertError, match="refused the map") as caught:
        run(tmp_path, document(road()).replace('length="100.0"', 'length="x"'))
    assert "length" in caught.value.output


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux limits a running child")
def test_too_little_memory_is_an_error_and_not_a_hang(tmp_path: Path) -> None:
    with pytest.raises(NetconvertError):
        run(tmp_path, document(road()), memory=8 * MEGABYTE)


def fake(folder: Path, script: str) -> Path:
    program = folder / "fake"
    program.write_text(f"#!{sys.executable}\n{script}\n")
    program.chmod(0o755)
    return program


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
    monkeypatch.setattr(netconvert, "netconvert_path", lambda: program)
    path = stage(tmp_path, {"m.xodr": b""}) / "m.xodr"
    with pytest.raises(NetconvertError, match=problem):
        run_netconvert(path, [], time_limit=0.1, memory_limit=1024 * MEGABYTE)


def test_without_netconvert_the_error_says_how_to_get_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(netconvert, "sumo_home", lambda: None)
    monkeypatch.setenv("PATH", "")
    with pytest.raises(MissingDependencyError, match="pip install"):
        netconvert_path()


def test_a_missing_map_is_an_input_error(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="No such file"):
        read_map(tmp_path / "none.xodr")


def test_a_missing_work_folder_is_a_workspace_error(tmp_path: Path) -> None:
    with pytest.raises(WorkspaceError):
        stage(tmp_path / "none", {"a": b""})
