from __future__ import annotations

from pathlib import Path

import pytest

from odscen.base.atomic_folders import new_folder
from odscen.base.to_disk import replace_by


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


def test_a_small_file_is_replaced_whole_as_text_or_bytes(tmp_path: Path) -> None:
    file = tmp_path / "a.txt"
    replace_by(file, tmp_path / "part", "é")
    assert file.read_bytes() == b"\xc3\xa9"
    replace_by(file, tmp_path / "part", b"\x00\x01")
    assert file.read_bytes() == b"\x00\x01"
    assert [path.name for path in tmp_path.iterdir()] == ["a.txt"]
