"""Computing in threads that is broken off from another one."""

import threading
import time

import pytest

from odscen.app.running.interruptible import BrokenOff, Interruptible


def test_a_thread_that_computes_is_broken_off_and_cleans_up() -> None:
    work, began, seen = Interruptible(), threading.Event(), list[str]()

    def compute() -> None:
        try:
            with work.computing():
                began.set()
                for _ in range(6000):
                    time.sleep(0.01)
                seen.append("whole")
        except BrokenOff:
            seen.append("broken off")

    thread = threading.Thread(target=compute)
    thread.start()
    began.wait()
    work.break_off()
    thread.join()
    assert seen == ["broken off"]


def test_what_begins_too_late_does_not_begin() -> None:
    work = Interruptible()
    work.break_off()
    with pytest.raises(BrokenOff), work.computing():
        pytest.fail("it began")


def test_who_has_ended_computing_is_left_alone() -> None:
    work = Interruptible()
    with work.computing():
        pass
    work.break_off()
    assert sum(range(1000)) == 499_500
