from __future__ import annotations

import os
from pathlib import Path

import pytest

from odscen.base.errors import InputError
from odscen.base.given_files import read_given, read_given_text


def test_a_regular_file_is_read(tmp_path: Path) -> None:
    file = tmp_path / "a.csv"
    file.write_text("ä")
    assert read_given(file) == b"\xc3\xa4"
    assert read_given_text(file) == "ä"


def test_what_might_never_end_is_refused_and_not_waited_for(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    for endless in (pipe, Path("/dev/zero"), Path("/dev/urandom")):
        with pytest.raises(InputError, match="a pipe, device or socket, not a regular file"):
            read_given(endless)


def test_a_huge_file_is_refused_before_it_is_read(tmp_path: Path) -> None:
    huge = tmp_path / "huge"
    with huge.open("wb") as file:
        file.truncate(5_000_000_000)
    with pytest.raises(InputError, match="5000000000 bytes; the limit is 256000000"):
        read_given(huge)


def test_other_encodings_are_told_with_the_first_byte_that_is_wrong(tmp_path: Path) -> None:
    file = tmp_path / "a.csv"
    file.write_bytes("from,tö".encode("latin-1"))
    with pytest.raises(InputError, match="not text in UTF-8: byte 6 is 0xf6"):
        read_given_text(file)


@pytest.mark.parametrize("name", ["none", "a\0b", "x" * 300])
def test_a_file_that_is_not_there_is_named(tmp_path: Path, name: str) -> None:
    with pytest.raises(InputError) as refused:
        read_given(tmp_path / name)
    assert refused.value.file is not None
    assert refused.value.file.isprintable()
