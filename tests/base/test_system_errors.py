import errno
import os
from pathlib import Path

import pytest

from odscen.base.errors import ResourceError, WorkspaceError
from odscen.base.system_errors import disk_errors


@pytest.mark.parametrize(
    ("number", "words"),
    [
        (errno.ENOSPC, "the disk is full; free some room"),
        (errno.EROFS, "nothing may be written here; make it writable"),
        (errno.EACCES, "nothing may be written here; make it writable"),
        (errno.EMFILE, "too many files are open; end other programs, or allow more"),
        (errno.ENOMEM, "the memory is used up; end other programs, or run less at a time"),
    ],
)
def test_what_the_machine_lacks_is_said_with_what_to_do_and_ends_with_3(number, words):
    with (
        pytest.raises(ResourceError, match=rf"^run x: {words}.* \(plan.json\)") as caught,
        disk_errors("run x"),
    ):
        raise OSError(number, os.strerror(number), "plan.json")
    assert caught.value.exit_code == 3


def test_other_errors_of_the_system_keep_their_words_and_end_with_2():
    with (
        pytest.raises(WorkspaceError, match="run x: Is a directory") as caught,
        disk_errors("run x"),
    ):
        raise OSError(errno.EISDIR, os.strerror(errno.EISDIR))
    assert caught.value.exit_code == 2


def test_a_full_disk_is_told_by_the_writer_itself():
    """``/dev/full`` is a disk without room."""
    with (
        pytest.raises(ResourceError, match="the disk is full"),
        disk_errors("x"),
        Path("/dev/full").open("w", encoding="utf-8") as file,
    ):
        file.write("a" * 100)
