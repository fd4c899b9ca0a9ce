"""``python -m tools.make_maps [--only NAME] [-o DIR]``: write the maps that ship.

Others, such as ``large_town`` and ``varied_town_07``, are written only when they are named.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from scenariogeneration import xodr

from tools.make_maps.document import document, mirrored, text
from tools.make_maps.maps import LEFT_HAND, MAPS, ON_DEMAND

SHIPPED = Path(__file__).parents[2] / "maps"


def main() -> None:
    """Write the maps asked for."""
    parser = argparse.ArgumentParser(prog="make_maps", description=main.__doc__)
    parser.add_argument("--only", choices=[*MAPS, *ON_DEMAND])
    parser.add_argument("-o", "--out", type=Path, default=SHIPPED)
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    for name in [arguments.only] if arguments.only else MAPS:
        target = arguments.out / f"{name}.xodr"
        target.write_text(map_text(name), encoding="utf-8", newline="\n")
        print(f"{target.name}: {target.stat().st_size / 1000:.0f} kB")


def map_text(name: str) -> str:
    """Text of one map.

    Parameters
    ----------
    name
        One of :data:`tools.make_maps.maps.MAPS` or ``ON_DEMAND``.
    """
    # The library remembers ids over all maps of a process; ours start afresh with each.
    for kind in (xodr.Object, xodr.Signal, xodr.SignalReference):
        kind._usedIDs.clear()
        kind._IDCounter.clear()
    root = document((MAPS | ON_DEMAND)[name](name))
    return text(mirrored(root) if name in LEFT_HAND else root)


if __name__ == "__main__":
    main()
