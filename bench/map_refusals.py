"""Maps that are refused, and what carla.Map and netconvert make of the same files.

All maps at hand (shipped, those of ``ODSCEN_TEST_MAPS`` and any folders named) and damaged copies
of the small ones are read. Each that is refused is given to both peers, each in a process of its
own: ``takes`` means that the peer ends well with a map that is one, which for carla.Map is
waypoints with finite places, and for netconvert a network with an edge. What both take and odscen
refuses is named: those are the refusals to argue for.

    python -m bench map_refusals --count 300 --seed 1 [FOLDER ...]
"""

from __future__ import annotations

import argparse
import re
import subprocess
import sys
import tempfile
from collections import Counter, defaultdict
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import sumo

from bench.common import shared_maps
from odscen.base.errors import OdscenError
from odscen.maps.shipped import shipped_maps
from odscen.opendrive.lanes import RoadTable
from odscen.opendrive.parse import parse
from tests.opendrive.mutate import mutations

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

SMALL = 100_000
"""Bytes of a map that is damaged, at most."""

SECONDS = 30.0
"""Of a peer, at most."""

_CARLA = """
import math, sys, carla
text = open(sys.argv[1], encoding="utf-8", errors="replace").read()
points = carla.Map("m", text).generate_waypoints(5.0)
places = [p.transform.location for p in points]
sys.exit(0 if places and all(math.isfinite(p.x + p.y + p.z) for p in places) else 3)
"""


class Candidate(NamedTuple):
    """A file to be read: its name, the damage, and its bytes."""

    name: str
    damage: str
    data: bytes


class Judged(NamedTuple):
    """A refusal, and whether each peer takes the file."""

    candidate: Candidate
    reason: str
    carla: bool
    netconvert: bool


def main() -> None:
    parser = argparse.ArgumentParser(prog="bench map_refusals", description=__doc__)
    parser.add_argument("folders", nargs="*", type=Path)
    parser.add_argument("--count", type=int, default=300, help="damaged copies, all together")
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    files = sorted(_files_of([shared_maps(), *arguments.folders]), key=str)
    whole = [Candidate(path.stem, "as it is", path.read_bytes()) for path in files]
    judged: list[Judged] = []
    with tempfile.TemporaryDirectory() as folder:
        for candidates, what in (
            (whole, "maps as they are"),
            (list(_damaged(whole, arguments.count, arguments.seed)), "damaged copies"),
        ):
            found = [_judge(one, Path(folder)) for one in candidates]
            refused = [one for one in found if one is not None]
            print(f"{what}: {len(candidates)} read, {len(refused)} refused", flush=True)
            judged += refused
    _print_table(judged)


def _files_of(folders: Sequence[Path | None]) -> Iterator[Path]:
    yield from shipped_maps()
    for folder in folders:
        if folder is not None:
            yield from folder.rglob("*.xodr")


def _damaged(whole: Sequence[Candidate], count: int, seed: int) -> Iterator[Candidate]:
    small = [one for one in whole if len(one.data) <= SMALL]
    for number, one in enumerate(small):
        share = count // len(small) + (number < count % len(small))
        for mutation in mutations(one.data, seed + number, share):
            yield Candidate(one.name, mutation.kind, mutation.data)


def _judge(candidate: Candidate, folder: Path) -> Judged | None:
    try:
        RoadTable.of(parse(candidate.data, file=candidate.name))
    except OdscenError as error:
        path = folder / "map.xodr"
        path.write_bytes(candidate.data)
        return Judged(candidate, str(error), _carla_takes(path), _netconvert_takes(path))
    return None


def _ends_well(command: Sequence[str]) -> bool:
    try:
        done = subprocess.run(command, capture_output=True, timeout=SECONDS, check=False)
    except subprocess.TimeoutExpired:
        return False
    return done.returncode == 0


def _carla_takes(path: Path) -> bool:
    return _ends_well([sys.executable, "-c", _CARLA, str(path)])


def _netconvert_takes(path: Path) -> bool:
    net = path.with_suffix(".net.xml")
    net.unlink(missing_ok=True)
    command = [
        str(Path(sumo.SUMO_HOME) / "bin" / "netconvert"),
        "--opendrive-files",
        str(path),
        "-o",
        str(net),
    ]
    return _ends_well(command) and b'<edge id="' in net.read_bytes()


def _print_table(judged: Sequence[Judged]) -> None:
    """One row for each kind of refusal, with the numbers, names and places left out."""
    kinds: dict[str, list[Judged]] = defaultdict(list)
    for one in judged:
        kinds[_kind_of(one.reason)].append(one)
    print(f"\n{'refusals':>8} {'carla takes':>12} {'netconvert takes':>17} {'both':>5}  reason")
    for kind, own in sorted(kinds.items(), key=lambda item: (-len(item[1]), item[0])):
        takes = Counter((one.carla, one.netconvert) for one in own)
        carla = sum(count for (taken, _), count in takes.items() if taken)
        netconvert = sum(count for (_, taken), count in takes.items() if taken)
        print(f"{len(own):8} {carla:12} {netconvert:17} {takes[True, True]:5}  {kind}")
    both = [one for one in judged if one.carla and one.netconvert]
    print(f"\n{len(judged)} refused; both peers take {len(both)} of these files:")
    for one in both:
        print(f"  {one.candidate.name} ({one.candidate.damage}): {one.reason[:160]}")


def _kind_of(reason: str) -> str:
    text = re.sub(r"'[^']*'|\"[^\"]*\"", "...", reason.splitlines()[0])
    text = re.sub(r"^.*?: (?=\S)", "", text) if ": " in text else text
    return re.sub(r"-?\d[\w.+-]*", "#", text)[:110]


if __name__ == "__main__":
    main()
