from __future__ import annotations

import json
import os
from pathlib import Path

import pytest

from odscen.base.errors import InputError
from odscen.maps.map_files import read_map_file
from odscen.maps.store import Workspace
from tests.opendrive.snippets import document, road


def test_a_regular_file_is_read(tmp_path: Path) -> None:
    file = tmp_path / "a.xodr"
    file.write_text(document(road()))
    assert read_map_file(file) == document(road()).encode()


def test_a_pipe_is_refused_and_not_waited_for(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.xodr")
    with pytest.raises(InputError, match=r"pipe\.xodr: this is a pipe, device or socket"):
        read_map_file(tmp_path / "pipe.xodr")


@pytest.mark.skipif(not Path("/dev/zero").exists(), reason="no /dev/zero here")
def test_a_device_without_an_end_is_refused() -> None:
    with pytest.raises(InputError, match="/dev/zero: this is a pipe, device or socket"):
        read_map_file(Path("/dev/zero"))


def test_a_huge_file_is_refused_before_it_is_read(tmp_path: Path) -> None:
    with (tmp_path / "sparse.xodr").open("wb") as file:
        file.truncate(5 * 2**30)
    with pytest.raises(InputError, match="has 5368709120 bytes; the limit is 256000000"):
        read_map_file(tmp_path / "sparse.xodr")


def test_a_folder_and_a_file_that_is_not_there_say_so(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="this is a folder"):
        read_map_file(tmp_path)
    with pytest.raises(InputError, match="No such file"):
        read_map_file(tmp_path / "none.xodr")


def test_a_file_whose_name_is_no_text_is_added(tmp_path: Path) -> None:
    name = b"bad\xff\xe2\x80\xae.xodr"
    try:
        (tmp_path / os.fsdecode(name)).write_text(document(road()))
    except OSError:
        pytest.skip("this file system takes names of text only")
    entry = Workspace.open(tmp_path / "ws").add_map(tmp_path / os.fsdecode(name))
    assert entry.name == "bad"
    info = json.loads((entry.folder / "map.json").read_text(encoding="utf-8"))
    assert info["source"] == "bad\\udcff\\u202e.xodr"
    (tmp_path / os.fsdecode(name)).write_text("<OpenDRIVE>")
    with pytest.raises(InputError, match=r"^bad\\udcff\\u202e\.xodr: not well-formed XML: [^(]+$"):
        Workspace.open(tmp_path / "ws").add_map(tmp_path / os.fsdecode(name))
