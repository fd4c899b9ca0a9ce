"""Random numbers by name: what is drawn for one name does not depend on what else is drawn."""

from __future__ import annotations

import zlib

import numpy as np


def stream(seed: int, *names: str) -> np.random.Generator:
    """Random numbers of one name, independent of what else is drawn, and of the order."""
    words = [zlib.crc32(name.encode()) for name in names]
    return np.random.default_rng(np.random.SeedSequence([seed, *words]))
