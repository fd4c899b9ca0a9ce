import os
import sys
import time

import pytest

from odscen.base.work_beside import work_beside


def test_work_is_done_in_another_process_when_the_body_is_left(tmp_path):
    by = tmp_path / "by"
    with work_beside(lambda: by.write_text(str(os.getpid()))):
        pass
    forked = sys.platform.startswith("linux")
    assert (int(by.read_text()) == os.getpid()) != forked


def test_what_failed_there_is_done_here_so_that_its_error_is_raised(tmp_path):
    tries = tmp_path / "tries"

    def work():
        with tries.open("a") as file:
            file.write("x")
        raise ValueError("of the work")

    with pytest.raises(ValueError, match="of the work"), work_beside(work):
        pass
    assert set(tries.read_text()) == {"x"}


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="forks on Linux only")
def test_a_body_that_raises_ends_the_work(tmp_path):
    begun, done = tmp_path / "begun", tmp_path / "done"

    def work():
        begun.write_text(str(os.getpid()))
        time.sleep(60.0)
        done.touch()

    def begin_and_fail():
        with work_beside(work):
            while not begun.exists() or not begun.read_text():
                time.sleep(0.01)
            raise KeyError

    with pytest.raises(KeyError):
        begin_and_fail()
    assert not done.exists()
    with pytest.raises(ProcessLookupError):  # it has ended, and was waited for
        os.kill(int(begun.read_text()), 0)
