"""``python -m bench [NAME...]``: run all benchmarks, or those named.

After one name, options are that benchmark's own: ``python -m bench fuzz --minutes 2``.
"""

from __future__ import annotations

import importlib
import sys

from bench.common import compile_modules

ALL = (
    "startup",
    "lane_graph",
    "maps_add",
    "map_refusals",
    "map_meaning",
    "netconvert_maps",
    "osm_converters",
    "osm_elements",
    "capacity",
    "saturation",
    "motion",
    "published",
    "intervals",
    "weather",
    "signal_timing",
    "assignment",
    "recording",
    "recorded_hour",
    "short_runs",
    "studies",
    "network_size",
    "study_kills",
    "regression_suite",
    "critical_search",
    "rules",
    "behaviour",
    "learning",
    "osc_import",
    "long_run",
    "live_view",
    "server_load",
    "sizes",
    "carla_mirror",
    "simulators_agree",
    "foreign_poses",
    "canvas",
    "scenery",
    "in_browser",
    "editing",
)


def main() -> None:
    compile_modules()
    names = sys.argv[1:]
    if len(names) > 1 and names[1].startswith("-"):
        names, sys.argv = names[:1], [f"bench {names[0]}", *names[1:]]
    else:
        sys.argv = sys.argv[:1]  # benchmarks that have options read them
    for name in names or ALL:
        print(f"== {name}", flush=True)
        importlib.import_module(f"bench.{name}").main()


main()
