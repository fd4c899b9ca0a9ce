"""Bytes of stored folders changed one after the other: who reads on as if nothing had happened.

``python -m bench changed_bytes [--most N] [--kinds KIND...]``: of a map, a finished run, an
interrupted one, a study, a sweep, a dataset and the results of a suite each byte of each file is
changed, and every reader asked: commands, exports, what resumes, and the routes of the page. Small
files are changed byte by byte; of those with more than :data:`WHOLE` bytes as many are changed,
spread over the file. The first reader of a kind is asked about each, the others about
:data:`OTHERS` bytes of each file. ``--whole`` sets another number of bytes of each file, and
``--most`` changes so many at random instead.
"""

from __future__ import annotations

import argparse
import random
import shutil
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from odscen.base.errors import DamagedError, InputError, OdscenError

WHOLE = 4000
OTHERS = 24
PASSING = (".lock", ".part")
Reader = Callable[[], Any]


class Unnoticed(NamedTuple):
    """A byte that a reader did not notice."""

    kind: str
    file: str
    place: int
    reader: str

    def __str__(self) -> str:
        return f"{self.reader} of a {self.kind} does not notice byte {self.place} of {self.file}"


class Found(NamedTuple):
    """How many bytes were changed, how many readers were asked, and what was not noticed."""

    changed: int
    asked: int
    unnoticed: list[Unnoticed]


@dataclass(frozen=True)
class Folder:
    """A folder of one kind: ``workspace`` has the map and the runs, ``beside`` all else."""

    kind: str
    workspace: Path
    beside: Path

    @property
    def path(self) -> Path:
        if self.kind == "map":
            return next((self.workspace / "maps").glob("*/map.json")).parent
        known = {"run": "done", "interrupted run": "sliced"}
        if self.kind in known:
            return self.workspace / "runs" / known[self.kind]
        return self.beside / "folders" / self.kind

    def readers(self) -> dict[str, Reader]:
        """All that reads it, by name."""
        return FOLDERS[self.kind](self)

    def files(self) -> list[str]:
        """Files that readers compute with; locks, logs, pages and files in the making are not."""
        found = (path for path in self.path.rglob("*") if path.is_file())
        names = sorted(path.relative_to(self.path).as_posix() for path in found)
        return [name for name in names if not _is_left(self.kind, name)]


def _is_left(kind: str, name: str) -> bool:
    """Whether nothing is computed from a file: docs/strangers.md lists these."""
    if name.endswith(PASSING):
        return True
    # Killed as it ended, a run has a summary, which resuming removes before it goes on.
    if kind == "interrupted run" and name in ("sumo.log", "summary.json"):
        return True
    return kind in ("study", "sweep") and name.endswith(".html")


class _WouldResumeError(Exception):
    """A run would be resumed: all that it goes on from was believed."""


class _Told:
    """Hears what is said of slices that are damaged."""

    def __init__(self) -> None:
        self.words: list[str] = []

    def said(self, words: str) -> None:
        self.words.append(words)

    def started(self) -> None: ...

    def advanced(self, *_: Any) -> None: ...


def _map_readers(folder: Folder) -> dict[str, Reader]:
    from odscen.maps.store import Workspace

    place, name = Workspace.open(folder.workspace), folder.path.name

    def ask_doctor() -> None:
        if place.stored(name).damaged():
            raise InputError("damaged")

    def read_all() -> None:
        entry = place.map(name)
        for key in entry.info["files"]:
            entry.read(key)

    return {"doctor": ask_doctor, "whoever opens it": read_all}


def _run_readers(folder: Folder) -> dict[str, Reader]:
    from odscen.app.exchange.exports import export_run
    from odscen.app.running.reports import renew_report
    from odscen.experiments.comparisons import compare
    from odscen.maps.store import Workspace
    from odscen.runs.finished_run import Run

    place, run, out = Workspace.open(folder.workspace), folder.path, folder.beside / "read"
    readers: dict[str, Reader] = {
        "compare": lambda: compare(run, run),
        "Run.open": lambda: Run.open(run),
        "report": lambda: renew_report(place, run, out=out / "again.html"),
        **{
            f"export {form}": lambda form=form: export_run(place, run, out / form, to=form)
            for form in ("pyg", "commonroad", "scenarionet", "waymo")
        },
    }
    return readers | _page(
        place.root,
        *(
            f"/api/runs/done/{route}"
            for route in (
                "summary", "events", "trajectories", "curves", "egos", "lanes", "signals",
                "report.html", "fit",
            )
        ),
    )  # fmt: skip


def _interrupted_readers(folder: Folder) -> dict[str, Reader]:
    from odscen.app.exchange.exports import export_run
    from odscen.app.running.reports import renew_report
    from odscen.experiments.comparisons import compare
    from odscen.maps.store import Workspace
    from odscen.sumo.runner import long_runs

    place, run, out = Workspace.open(folder.workspace), folder.path, folder.beside / "read"

    def stop(_: Any) -> None:
        raise _WouldResumeError

    def resume() -> None:
        told, known = _Told(), long_runs.unseal_interrupted
        long_runs.unseal_interrupted = stop
        try:
            long_runs.resume(run, reporter=told)  # type: ignore[arg-type]
        except _WouldResumeError:
            if any("damaged" in words or "slice" in words for words in told.words[:-1]):
                raise InputError(told.words[0]) from None
            raise
        finally:
            long_runs.unseal_interrupted = known

    def resumed() -> None:
        with suppress(_WouldResumeError):
            resume()

    return {
        "resume": resumed,
        "report": lambda: renew_report(place, run, out=out / "again.html"),
        "compare": lambda: compare(run, run),
        "export": lambda: export_run(place, run, out, to="pyg"),
    }


def _study_readers(folder: Folder) -> dict[str, Reader]:
    from odscen.experiments.studies import carry_out_study, study_results, study_state
    from odscen.experiments.work import LocalExecutor
    from odscen.maps.store import Workspace

    place = Workspace.open(folder.workspace)
    (place.root / "studies").mkdir(exist_ok=True)
    with suppress(FileExistsError):
        (place.root / "studies" / "study").symlink_to(folder.path)
    executor = LocalExecutor(place, processes=1)
    return {
        "resume": lambda: carry_out_study(folder.path, executor),
        "results": lambda: study_results(folder.path),
        "state": lambda: study_state(folder.path),
        **_page(
            place.root, "/api/studies/study/results", "/api/studies/study/files/results.parquet"
        ),
    }


def _sweep_readers(folder: Folder) -> dict[str, Reader]:
    from odscen.app.scenarios import read_scenario
    from odscen.experiments.sweeps import SweepSettings, read_table, sweep
    from odscen.maps.store import Workspace
    from odscen.scenario.sweeps.sweep_plan import SweepPlan, axis_from_text

    place = Workspace.open(folder.workspace)
    scenario = read_scenario(folder.beside / "turned.scenario.json")
    plan = SweepPlan((axis_from_text("gap=6,20"),))
    return {
        "resume": lambda: sweep(place, scenario, plan, folder.path, settings=SweepSettings()),
        "table": lambda: read_table(folder.path),
    }


def _dataset_readers(folder: Folder) -> dict[str, Reader]:
    from odscen.experiments.dataset_plan import read_dataset_plan
    from odscen.experiments.datasets import make_dataset
    from odscen.experiments.work import LocalExecutor
    from odscen.maps.store import Workspace

    place = Workspace.open(folder.workspace)
    plan = read_dataset_plan(folder.beside / "dataset.toml")
    executor = LocalExecutor(place, processes=1)
    return {
        "resume": lambda: make_dataset(place, plan, folder.path, executor, beside=folder.beside)
    }


def _suite_readers(folder: Folder) -> dict[str, Reader]:
    from odscen.experiments.suite_runs import read_parts

    return {"merge": lambda: read_parts([folder.path])}


def _page(root: Path, *targets: str) -> dict[str, Reader]:
    """Routes of the page, asked in this process; an answer below 400 has believed what it read."""
    from starlette.testclient import TestClient

    from odscen.maps.store import Workspace
    from odscen.web.application import create_app
    from odscen.web.security import LOOPBACK

    client = TestClient(
        create_app(Workspace.open(root), hosts=LOOPBACK | {"testserver"}),
        raise_server_exceptions=False,
    )

    def ask(target: str) -> None:
        answer = client.get(target)
        if answer.status_code >= 500 and answer.status_code != 507:
            raise RuntimeError(f"{target} answers {answer.status_code}")
        if answer.status_code >= 400:
            raise InputError(answer.text[:200])

    return {f"GET {target}": lambda target=target: ask(target) for target in targets}


FOLDERS: Mapping[str, Callable[[Folder], dict[str, Reader]]] = {
    "map": _map_readers,
    "run": _run_readers,
    "interrupted run": _interrupted_readers,
    "study": _study_readers,
    "sweep": _sweep_readers,
    "dataset": _dataset_readers,
    "suite": _suite_readers,
}

_READ: dict[tuple[str, str], tuple[str, ...]] = {
    ("study", "results"): ("study.json", "scenarios/", "journal.jsonl", "rows/"),
    ("study", "state"): ("study.json", "scenarios/", "journal.jsonl", "rows/"),
    ("study", "GET /api/studies/study/results"): (
        "study.json",
        "scenarios/",
        "journal.jsonl",
        "rows/",
    ),
    ("study", "GET /api/studies/study/files/results.parquet"): ("results.parquet",),
    ("sweep", "table"): ("SHA256SUMS", "sweep.json", "scenario.json", "cases.parquet"),
    ("run", "Run.open"): (),
    ("run", "report"): (),
}
"""Files that a reader reads, where it does not read all; empty: all but the report."""


def _reads(kind: str, reader: str, name: str) -> bool:
    chosen = _READ.get((kind, reader))
    if chosen is None:
        # Exports and the report are made anew from the rest.
        return not (kind == "run" and name == "report.html" and reader.startswith("export"))
    return name.startswith(chosen) if chosen else name != "report.html"


@contextmanager
def changed_byte(folder: Path, name: str, place: int, bit: int, kept: Path) -> Iterator[None]:
    """Change one byte of a file, and put back all of its folder, of which a copy is kept.

    What resumes a run removes slices that are damaged, and those after them.
    """
    file = folder / name
    changed = bytearray(file.read_bytes())
    changed[place] ^= bit
    file.unlink()  # the network of a run is a link to the map's
    file.write_bytes(changed)
    try:
        yield
    finally:
        file.unlink(missing_ok=True)
        for path in kept.rglob("*"):
            there = folder / path.relative_to(kept)
            if not there.exists():
                if path.is_dir():
                    shutil.copytree(path, there)
                else:
                    shutil.copy2(path, there)


def places_of(size: int, most: int = WHOLE) -> list[int]:
    """Each byte, or so many of them spread over the file, its first and last among them."""
    if size <= most:
        return list(range(size))
    return sorted({round(n * (size - 1) / (most - 1)) for n in range(most)})


def unnoticed(
    folder: Folder,
    *,
    most: int | None = None,
    seed: int = 0,
    spread: int = OTHERS,
    whole: int = WHOLE,
) -> Found:
    """Change bytes of a folder and ask its readers; ``most`` at random, or all that are due."""
    readers = folder.readers()
    chance = random.Random(seed)
    files = [name for name in folder.files() if (folder.path / name).stat().st_size]
    due: list[tuple[str, int, Sequence[str]]] = []
    if most is not None:
        for _ in range(most):
            name = chance.choice(files)
            place = chance.randrange((folder.path / name).stat().st_size)
            due.append((name, place, chance.sample(sorted(readers), min(3, len(readers)))))
    else:
        first = next(iter(readers))
        for name in files:
            places = places_of((folder.path / name).stat().st_size, whole)
            some = set(places[:: max(1, len(places) // spread)]) | {places[-1]}
            due += [(name, at, list(readers) if at in some else [first]) for at in places]
    asked, found = 0, []
    kept = folder.beside / "kept"
    shutil.copytree(folder.path, kept)
    for name, place, chosen in due:
        with changed_byte(folder.path, name, place, 1 << chance.randrange(8), kept):
            for reader in chosen:
                if not _reads(folder.kind, reader, name):
                    continue
                asked += 1
                try:
                    readers[reader]()
                except OdscenError as error:
                    if isinstance(error, InputError | DamagedError):
                        continue
                    raise
                found.append(Unnoticed(folder.kind, name, place, reader))
    return Found(len(due), asked, found)


def main() -> None:
    options = argparse.ArgumentParser(prog="bench changed_bytes")
    options.add_argument("--most", type=int, help="bytes of each kind, at random")
    options.add_argument("--kinds", nargs="+", choices=list(FOLDERS), default=list(FOLDERS))
    options.add_argument("--whole", type=int, default=WHOLE, help="most bytes of each file")
    options.add_argument("--seed", type=int, default=0)
    asked = options.parse_args()
    from bench.fuzz.limits import Limits
    from bench.fuzz.material import prepare

    print("| folder | files | bytes | changed | readers asked | not noticed | s |")
    print("|---|---|---|---|---|---|---|")
    with tempfile.TemporaryDirectory(prefix="odscen-bench-") as name:
        material = prepare(Path(name) / "material", Limits())
        for kind in asked.kinds:
            # A copy, so that what a reader writes is not in the next folder.
            beside = Path(name) / kind
            shutil.copytree(material.root, beside)
            folder = Folder(kind, beside / "workspace", beside)
            files = folder.files()
            size = sum((folder.path / one).stat().st_size for one in files)
            begun = time.perf_counter()
            found = unnoticed(folder, most=asked.most, seed=asked.seed, whole=asked.whole)
            took = time.perf_counter() - begun
            print(
                f"| {kind} | {len(files)} | {size:,} | {found.changed:,} | {found.asked:,} "
                f"| {len(found.unnoticed)} | {took:.0f} |",
                flush=True,
            )
            for one in found.unnoticed[:20]:
                print(f"  {one}", flush=True)


if __name__ == "__main__":
    main()
