"""``python -m bench [NAME...]``: run all benchmarks, or those named."""

from __future__ import annotations

import importlib
import sys

ALL = (
    "startup",
    "lane_graph",
    "maps_add",
    "capacity",
    "saturation",
    "signal_timing",
    "recording",
    "long_run",
    "live_view",
    "server_load",
    "carla_mirror",
    "canvas",
    "in_browser",
)


def main() -> None:
    for name in sys.argv[1:] or ALL:
        print(f"== {name}", flush=True)
        importlib.import_module(f"bench.{name}").main()


main()
