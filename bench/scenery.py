"""A town in three dimensions, drawn in software by headless Chromium: frames per second.

Aims on Town04: 30 frames a second with 300 road users, 10 with 2,000.
``frontend/bench`` has the page.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from bench.canvas import town_page

AIMS = {300: 30, 2000: 10}
"""Frames per second, by the number of road users."""

VIEWS = {
    "whole map": ("above", True),
    "3 px/m": ("above", False),
    "following": ("behind", False),
    "driver's seat": ("seat", False),
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--picture", type=Path, help="write what is seen at the end as a PNG")
    picture = parser.parse_args().picture
    with town_page("scenery.html") as page:
        if page is None:
            return
        found = page.evaluate("window.odscenBench")
        times = f"{found['fetched']:.0f} ms to fetch, {found['ready']:.0f} to build"
        print(f"{found['map']}: {times}")
        for vehicles, aim in AIMS.items():
            for what, (camera, whole) in VIEWS.items():
                call = f"odscenSee({camera!r}, {str(whole).lower()}, {vehicles})"
                figures = page.evaluate(call)
                print(
                    f"  {vehicles:5} road users, {what:14} {figures['fps']:5.1f} frames/s "
                    f"(aim {aim}), page busy {figures['busy']:5.1f} ms each, "
                    f"longest pause {figures['worst']:.0f} ms",
                    flush=True,
                )
                if picture:
                    page.screenshot(path=picture.with_stem(f"{picture.stem}-{camera}-{whole}"))


if __name__ == "__main__":
    main()
