import json
import shutil
import subprocess

import pytest

from odscen.base import checksums
from odscen.base.checksums import damaged_files, read_sums, seal, sums_of, unsealed, write_sums
from odscen.base.errors import DamagedError


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "a.txt").write_text("one", encoding="utf-8")
    (tmp_path / "b").mkdir()
    (tmp_path / "b" / "c d.bin").write_bytes(bytes(range(256)))
    write_sums(tmp_path, sums_of(tmp_path))
    return tmp_path


def changed(content, place):
    return content[:place] + bytes([content[place] ^ 1]) + content[place + 1 :]


def test_what_was_written_is_found_whole(folder):
    sums = read_sums(folder)
    assert list(sums) == ["a.txt", "b/c d.bin"]
    assert damaged_files(folder, sums) == []


@pytest.mark.skipif(shutil.which("sha256sum") is None, reason="there is no sha256sum here")
def test_sha256sum_reads_the_list(folder):
    done = subprocess.run(
        ["sha256sum", "--check", "--strict", checksums.SUMS_FILE],
        cwd=folder, capture_output=True, text=True, check=True,
    )  # fmt: skip
    assert done.stdout == "a.txt: OK\nb/c d.bin: OK\n"


def test_a_changed_or_missing_file_is_named_with_what_was_expected_and_found(folder):
    sums = read_sums(folder)
    (folder / "a.txt").write_text("two", encoding="utf-8")
    (folder / "b" / "c d.bin").unlink()
    first, second = damaged_files(folder, sums)
    assert first == ("a.txt", checksums.digest(b"one"), checksums.digest(b"two"))
    assert second.found == "no such file"
    assert damaged_files(folder, sums, may_miss=["b/c d.bin"]) == [first]


def test_any_changed_byte_of_the_list_itself_is_found(folder):
    file = folder / checksums.SUMS_FILE
    content = file.read_bytes()
    for place in range(len(content)):
        file.write_bytes(changed(content, place))
        with pytest.raises(DamagedError, match="SHA256SUMS: expected"):
            read_sums(folder)


def test_a_folder_without_a_list_is_one_of_an_earlier_version(tmp_path):
    assert read_sums(tmp_path) is None


@pytest.mark.parametrize("indent", [None, 2])
def test_any_changed_byte_of_a_sealed_object_is_found(tmp_path, indent):
    data = {"version": 2, "a": [1.5, {"b": None}], "c": {"d": "}\n"}}
    file = tmp_path / "state.json"
    file.write_text(seal(data, indent=indent), encoding="utf-8")
    assert unsealed(file) == data
    content = file.read_bytes()
    assert json.loads(content)["a"] == data["a"]
    for place in range(len(content)):
        file.write_bytes(changed(content, place))
        with pytest.raises((DamagedError, ValueError)):
            unsealed(file)


def test_what_an_earlier_version_wrote_has_no_seal_and_is_read(tmp_path):
    file = tmp_path / "state.json"
    file.write_text('{"version": 1, "a": 2}', encoding="utf-8")
    assert unsealed(file) == {"version": 1, "a": 2}


def test_a_list_that_is_something_else_is_named_and_not_quoted(folder):
    sums = folder / "SHA256SUMS"
    sums.write_text("# " + '[{"a":' * 5000)
    with pytest.raises(DamagedError) as refused:
        read_sums(folder)
    assert "SHA256SUMS: expected its own checksum in its last line, found sha256 " in str(
        refused.value
    )
    assert len(str(refused.value)) < 500


@pytest.mark.parametrize(
    "content", [b'{"version": 2,\0\0\0\0}', b'{"version": 2}', b"[" * 100_000, b"[]", b""]
)
def test_a_sealed_object_that_has_lost_its_seal_is_damaged(tmp_path, content):
    file = tmp_path / "status.json"
    file.write_bytes(content)
    with pytest.raises(DamagedError, match="expected its own checksum in its last line, found"):
        unsealed(file)
