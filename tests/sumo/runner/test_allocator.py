from __future__ import annotations

import subprocess

import pytest

from odscen.sumo.runner import allocator

LISTED = """3 libs found in cache `/etc/ld.so.cache'
\tlibtcmalloc_minimal.so.4 (libc6,x86-64) => /lib/libtcmalloc_minimal.so.4
\tlibjemalloc.so.2 (libc6,x86-64) => /lib/libjemalloc.so.2
\tlibm.so.6 (libc6,x86-64) => /lib/libm.so.6
"""


@pytest.mark.parametrize(
    ("listed", "found"),
    [
        (LISTED, "libtcmalloc_minimal.so.4"),
        (
            LISTED.replace("tcmalloc_minimal.so.4 (", "tcmalloc_minimal_debug.so.4 ("),
            "libjemalloc.so.2",
        ),
        ("", None),
    ],
)
def test_the_best_allocator_that_is_listed_is_taken(
    monkeypatch: pytest.MonkeyPatch, listed: str, found: str | None
) -> None:
    answer = subprocess.CompletedProcess([], 0, stdout=listed)
    monkeypatch.setattr(allocator.sys, "platform", "linux")
    monkeypatch.setattr(allocator.subprocess, "run", lambda *_, **__: answer)
    assert allocator.fast_allocator.__wrapped__() == found


def test_a_system_without_ldconfig_has_none(monkeypatch: pytest.MonkeyPatch) -> None:
    def missing(*_: object, **__: object) -> None:
        raise FileNotFoundError

    monkeypatch.setattr(allocator.subprocess, "run", missing)
    assert allocator.fast_allocator.__wrapped__() is None
