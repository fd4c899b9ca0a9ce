from __future__ import annotations

from pathlib import Path

import pytest

from odscen.base import to_disk
from odscen.base.atomic_folders import new_folder


@pytest.mark.parametrize("relative", [False, True])
def test_a_folder_is_brought_to_the_disk_by_whichever_path_it_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, relative: bool
) -> None:
    monkeypatch.chdir(tmp_path)
    place = Path("out/run") if relative else tmp_path / "out" / "run"
    with new_folder(place) as folder:
        (folder / "sumo").mkdir()
        (folder / "sumo" / "routes.xml").write_text("<routes/>")
    assert (tmp_path / "out" / "run" / "sumo" / "routes.xml").read_text() == "<routes/>"
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["run"]


def test_a_folder_is_on_its_way_to_the_disk_before_any_of_it_is_waited_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "sumo").mkdir()
    files = [tmp_path / "plan.json", tmp_path / "sumo" / "routes.xml"]
    for file in files:
        file.write_text("some", encoding="utf-8")
    asked: list[tuple[str, Path]] = []

    def named(descriptor: int) -> Path:
        return Path(f"/proc/self/fd/{descriptor}").readlink()

    begin = to_disk._write_out()
    if begin is None:
        pytest.skip("the system cannot be asked to begin")

    def begins(descriptor: int, *what: int) -> int:
        asked.append(("begin", named(descriptor)))
        return begin(descriptor, *what)

    def waits(descriptor: int) -> None:
        asked.append(("wait", named(descriptor)))

    monkeypatch.setattr(to_disk, "_write_out", lambda: begins)
    monkeypatch.setattr(to_disk.os, "fsync", waits)
    to_disk.all_to_disk(tmp_path)
    assert {path for what, path in asked[:2] if what == "begin"} == set(files)
    assert {path for what, path in asked[2:] if what == "wait"} == {
        *files, tmp_path / "sumo", tmp_path
    }  # fmt: skip
    assert [path for _, path in asked[-2:]] == [tmp_path / "sumo", tmp_path]


def test_the_system_takes_the_request_to_begin(tmp_path: Path) -> None:
    begin = to_disk._write_out()
    if begin is None:
        pytest.skip("the system cannot be asked to begin")
    with (tmp_path / "file").open("wb") as file:
        file.write(b"some")
        file.flush()
        assert begin(file.fileno(), 0, 0, to_disk._SYNC_FILE_RANGE_WRITE) == 0


def test_a_small_file_is_replaced_whole_as_text_or_bytes(tmp_path: Path) -> None:
    file = tmp_path / "a.txt"
    to_disk.replace_by(file, tmp_path / "part", "é")
    assert file.read_bytes() == b"\xc3\xa9"
    to_disk.replace_by(file, tmp_path / "part", b"\x00\x01")
    assert file.read_bytes() == b"\x00\x01"
    assert [path.name for path in tmp_path.iterdir()] == ["a.txt"]
