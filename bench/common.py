"""What the benchmarks share: where real maps lie, and paired timing."""

from __future__ import annotations

import bz2
import os
import statistics
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from xml.etree import ElementTree as ET

OUT = Path(__file__).parent / "out"


def shared_maps() -> Path | None:
    """Folder with real maps: ``$ODSCEN_TEST_MAPS``, else ``../shared/maps`` beside the project."""
    given = os.environ.get("ODSCEN_TEST_MAPS")
    folder = Path(given) if given else Path(__file__).parents[2] / "shared" / "maps"
    return folder if folder.is_dir() else None


def osm_extracts() -> list[Path]:
    """Extracts of OpenStreetMap of ``$ODSCEN_TEST_PLACES``, else of ``../shared/places/osm``.

    Says so if there are none.
    """
    given = os.environ.get("ODSCEN_TEST_PLACES")
    folder = Path(given) if given else Path(__file__).parents[2] / "shared" / "places" / "osm"
    extracts = sorted(folder.glob("*.osm*"))
    if not extracts:
        print(f"skipped: no extracts in {folder} (set ODSCEN_TEST_PLACES)")
    return extracts


def unpacked(extract: Path) -> bytes:
    """Content of an extract as XML."""
    content = extract.read_bytes()
    return bz2.decompress(content) if extract.suffix == ".bz2" else content


def compile_modules() -> None:
    """Have modules of processes that are started compiled once, as those of a package are.

    Whatever ``PYTHONDONTWRITEBYTECODE`` says: with it each process compiles all that it imports.
    """
    os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
    os.environ["PYTHONPYCACHEPREFIX"] = str(Path(tempfile.gettempdir()) / "odscen-bench-compiled")


def paired(
    ours: Callable[[], object], peer: Callable[[], object], *, repeats: int = 7
) -> tuple[float, float, float]:
    """Run both in turn; median seconds of each, and the median of the pairwise ratios ours/peer.

    Taking turns makes the ratio hold when the machine's speed drifts. One round of each goes first
    and is not counted.
    """
    ours()
    peer()
    times = [(_seconds(ours), _seconds(peer)) for _ in range(repeats)]
    return (
        statistics.median(mine for mine, _ in times),
        statistics.median(theirs for _, theirs in times),
        statistics.median(mine / theirs for mine, theirs in times),
    )


def _seconds(work: Callable[[], object]) -> float:
    start = time.perf_counter()
    work()
    return time.perf_counter() - start


def without_output(config: Path) -> Path:
    """Write the same configuration without output, and without files that only ask for some."""
    tree = ET.parse(config)
    root = tree.getroot()
    root.remove(next(section for section in root if section.tag == "output"))
    extra = root.find("input/additional-files")
    if extra is not None:
        names = extra.attrib["value"].split(",")
        kept = [name for name in names if not asks_for_output(config.with_name(name))]
        extra.attrib["value"] = ",".join(kept)
    silent = config.with_name("silent.sumocfg")
    tree.write(silent, encoding="unicode")
    return silent


def asks_for_output(additional: Path) -> bool:
    root = ET.parse(additional).getroot()
    return any("file" in element.attrib for element in root.iter())
