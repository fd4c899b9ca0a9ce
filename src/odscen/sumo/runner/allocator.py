"""A memory allocator for SUMO's many small objects that is faster than the system's own."""

from __future__ import annotations

import re
import subprocess
import sys
from functools import cache

NAMES = ("libtcmalloc_minimal.so.4", "libjemalloc.so.2")
"""The better one first: in a morning peak steps take 13 and 7 % less than with glibc's."""


@cache
def fast_allocator() -> str | None:
    """Name of the best that the dynamic linker finds, for ``LD_PRELOAD``; ``None`` without one."""
    if not sys.platform.startswith("linux"):
        return None
    try:
        listed = subprocess.run(
            ["/sbin/ldconfig", "-p"], check=True, capture_output=True, text=True, timeout=10
        )
    except (OSError, subprocess.SubprocessError):
        return None
    there = set(re.findall(r"^\s*(\S+) \(", listed.stdout, re.MULTILINE))
    return next((name for name in NAMES if name in there), None)
