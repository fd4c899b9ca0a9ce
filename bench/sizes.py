"""How what commands and routes take grows with the size of what they are given.

``python -m bench sizes [--kinds KIND...] [--of check run routes edits import sweep received]``:
scenarios on the shipped crossing with 1, 2, 4 and 8 times as many parts of one kind
(``bench/size_documents.py``), tables of as many rows, as many edits of one request, grids of as
many cases, and recordings, maps and histories of others (``bench/size_received.py``). CPU seconds
of a command with all that it starts, and of the server while it answers a request; the exponent is
that of the growth from the smallest to the largest, without what the same takes with the scenario
itself. ``/api/health`` is asked for all the time while the server works, and is too slow if the
server has computed that long.

Limits: an exponent of :data:`STEEPEST` (n log n, and noise), or :data:`SECONDS` with the largest;
:data:`ANSWER` bytes of an answer beyond the document; health within :data:`HEALTH`.
"""

from __future__ import annotations

import argparse
import http.client
import json
import math
import os
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import ClassVar, NamedTuple

import psutil

from bench import size_documents as grown
from bench import size_received as received
from odscen.app.generation import generate
from odscen.app.scenarios import SUFFIX
from odscen.maps.shipped import shipped_maps
from odscen.maps.store import Workspace
from odscen.scenario.sampling.generation_settings import GenerationSettings
from tests.signal_case import one_plan
from tools import page as tool

MAP = "signal_crossing"
FACTORS = (1, 2, 4, 8)
STEEPEST, SECONDS, ANSWER, HEALTH = 1.25, 5.0, 2_000_000, 0.5
NOISE = 0.05
"""CPU seconds that say nothing of how something grows."""
COMMAND = (sys.executable, "-m", "odscen")

KINDS: dict[str, tuple[grown.Grow, int]] = {
    "rules of one actor": (grown.rules_of_one_actor, 250),
    "rules that wait": (grown.rules_that_wait, 250),
    "rules of unknown actors": (grown.rules_of_unknown_actors, 250),
    "vehicle inputs": (grown.inputs, 250),
    "inputs to zones": (grown.inputs_to_zones, 250),
    "inputs on unknown segments": (grown.inputs_on_unknown_segments, 250),
    "rows of a matrix": (grown.matrix_rows, 1000),
    "matrices": (grown.matrices, 250),
    "rows of counts": (grown.count_rows, 1000),
    "stations": (grown.stations, 250),
    "stations on unknown nodes": (grown.stations_on_unknown_nodes, 250),
    "signal stages": (grown.signal_stages, 12),
    "plans of the day": (grown.signal_plans, 12),
    "signal detectors": (grown.signal_detectors, 125),
    "timings of one light": (grown.signal_timings, 250),
    "transit lines": (grown.transit_lines, 100),
    "transit stops": (grown.transit_stops, 100),
    "lines at unknown stops": (grown.lines_at_unknown_stops, 250),
    "closures": (grown.measures, 125),
    "outages of one light": (grown.measures_at_once, 250),
    "actors": (grown.actors, 500),
    "actors of unknown styles": (grown.actors_of_unknown_styles, 500),
    "flows": (grown.flows, 250),
}
RUN = (
    "rules of one actor",
    "rules that wait",
    "vehicle inputs",
    "inputs to zones",
    "rows of a matrix",
    "rows of counts",
    "stations",
    "signal stages",
    "plans of the day",
    "transit lines",
    "closures",
    "actors",
)
"""Kinds of which there are scenarios that run."""
TABLES: dict[str, tuple[str, str]] = {
    "inputs": ("segment,0,900", "{segment},1,2"),
    "od": ("from,to,trips,begin,end", "{segment},{other},1,{n},100000"),
    "zones": ("zone,segment", "z{n},{segment}"),
    "counts": ("place,begin,end,count", "{segment},{begin},{end},3"),
}
ROWS = 500
EDITS = 625
"""Of one request; eight times as many are the most that it may have."""
CASES = 5000


class Measured(NamedTuple):
    """CPU seconds, bytes that came back, and the longest that health took (0 for commands)."""

    seconds: float
    size: int
    health: float = 0.0


def main() -> None:
    options = argparse.ArgumentParser(prog="bench sizes")
    options.add_argument("--kinds", nargs="+", choices=list(KINDS), default=list(KINDS))
    options.add_argument(
        "--of",
        nargs="+",
        default=["check", "run", "routes", "edits", "import", "sweep", "received"],
        metavar="WHAT",
    )
    asked = options.parse_args()
    print(
        f"limits: exponent {STEEPEST}, or {SECONDS:g} s with the largest; {ANSWER / 1e6:g} MB of an"
        f" answer beyond the document; health within {HEALTH} s"
    )
    print("| what | of | n | CPU s with n, 2n, 4n, 8n | exponent | kB back | health, s | |")
    print("|---|---|---|---|---|---|---|---|")
    with tempfile.TemporaryDirectory(prefix="odscen-bench-") as name:
        folder = Path(name)
        workspace = Workspace.open(folder / "workspace")
        workspace.add_map(next(path for path in shipped_maps() if path.stem == MAP))
        base = based(workspace, folder)
        commands = Commands(workspace, folder)
        if "check" in asked.of:
            for kind in asked.kinds:
                grow, number = KINDS[kind]
                measured = measure(commands.check, base, grow, number)
                show(kind, "`check`", number, measured)
        if "run" in asked.of:
            for kind in [kind for kind in asked.kinds if kind in RUN]:
                grow, number = KINDS[kind]
                show(kind, "`run --until 1`", number, measure(commands.run, base, grow, number))
        if "import" in asked.of:
            for table, (head, row) in TABLES.items():
                content = tables(base, head, row)
                work = [commands.import_table(base, table, content(n)) for n in sizes(ROWS)]
                show(f"rows of a table: {table}", "`demand import`", ROWS, work)
        if "received" in asked.of:
            for kind, (command, write, number) in received.FILES.items():
                work = [commands.receive(command, write(folder, n)) for n in sizes(number)]
                show(kind, f"`{Commands.RECEIVING[command][0]}`", number, work)
        if "sweep" in asked.of:
            work = [commands.sweep(base, max(n, 2)) for n in sizes(CASES)]
            show("cases", "`sweep --dry-run`", CASES, work)
        if {"routes", "edits"} & set(asked.of):
            with tool.served(workspace.root) as server:
                routes = Routes(server.url.removeprefix("http://"), server.process.pid)
                for kind in asked.kinds if "routes" in asked.of else ():
                    grow, number = KINDS[kind]
                    documents = [base, *(grow(base, number * factor) for factor in FACTORS)]
                    rows = list(zip(*map(routes.use, documents), strict=True))
                    for label, measured in zip(Routes.LABELS, rows, strict=True):
                        show(kind, label, number, measured)
                for kind, made in grown.EDITS.items() if "edits" in asked.of else ():
                    work = [routes.edits(base, made(base, n)) for n in sizes(EDITS)]
                    show(kind, "POST edits", EDITS, work)
                for table, (head, row) in TABLES.items() if "routes" in asked.of else ():
                    content = tables(base, head, row)
                    work = [routes.table(base, table, content(n)) for n in sizes(ROWS)]
                    show(f"rows of a table: {table}", "POST demand/table", ROWS, work)


def sizes(number: int) -> list[int]:
    """One, and the number times each factor."""
    return [1, *(number * factor for factor in FACTORS)]


def based(workspace: Workspace, folder: Path) -> grown.Document:
    """A scenario with cars, walkers and a program of its own for the light, and a parameter."""
    settings = GenerationSettings(map_name=MAP, seed=5, fill=0.25)
    path = generate(workspace, settings=settings, out=folder)[0]
    document: grown.Document = json.loads(path.read_text(encoding="utf-8"))
    return document | {
        "signals": {"junctions": [one_plan()]},
        "parameters": {"gap": {"value": 10.0, "min": 0.0, "max": 100.0}},
        "simulation": {"duration": 600.0},
    }


def tables(base: grown.Document, head: str, row: str) -> Callable[[int], str]:
    roads = [segment for segment in base["roi"] if segment.startswith("r")]

    def content(number: int) -> str:
        rows = (
            row.format(segment=roads[0], other=roads[1], n=n, begin=60 * n, end=60 * n + 60)
            for n in range(number)
        )
        return "\n".join([head, *rows]) + "\n"

    return content


def measure(
    work: Callable[[grown.Document], Measured],
    base: grown.Document,
    grow: grown.Grow,
    number: int,
) -> list[Measured]:
    """The scenario itself, then each factor; what takes minutes is not doubled again."""
    measured = [work(base)]
    for factor in FACTORS:
        measured.append(work(grow(base, number * factor)))
        if measured[-1].seconds > 20 * SECONDS:
            break
    return measured


class Commands:
    """Commands on a scenario in a file, as processes of their own."""

    def __init__(self, workspace: Workspace, folder: Path) -> None:
        self._workspace, self._folder = workspace, folder

    def check(self, document: grown.Document) -> Measured:
        return self._command("check", self._written(document))

    def run(self, document: grown.Document) -> Measured:
        out = self._folder / f"run-{time.monotonic_ns()}"
        given = ("--until", "1", "--no-report", "--out", out)
        return self._command("run", self._written(document), *given)

    def import_table(self, document: grown.Document, kind: str, content: str) -> Measured:
        table = self._folder / "table.csv"
        table.write_text(content, encoding="utf-8")
        scenario = self._written(document)
        return self._command("demand", "import", scenario, f"--{kind}", table)

    RECEIVING: ClassVar[dict[str, tuple[str, tuple[str, ...]]]] = {
        "recording": (
            "recording show --scenes",
            ("--map", MAP, "--json", "--columns", received.COLUMNS),
        ),
        "map": ("maps add", ("--name", "received")),
        "history": ("history", ("--json",)),
    }
    """What reads a file of others: the command, and what is said beside the file."""

    def receive(self, command: str, file: Path) -> Measured:
        """Have a file read that others have written; a map is another one each time."""
        words, more = self.RECEIVING[command]
        first, *flags = words.split(" --")
        words = (*first.split(), file, *(f"--{flag}" for flag in flags), *more)
        return self._command(*words, codes=(0,))

    def sweep(self, document: grown.Document, cases: int) -> Measured:
        scenario = self._written(document)
        return self._command("sweep", scenario, "--vary", f"gap=1..90:{cases}", "--dry-run")

    def _written(self, document: grown.Document) -> Path:
        path = self._folder / f"size{SUFFIX}"
        path.write_text(json.dumps(document), encoding="utf-8")
        return path

    def _command(self, *words: str | Path, codes: tuple[int, ...] = (0, 2)) -> Measured:
        before = os.times()
        said = subprocess.run(
            [*COMMAND, *map(str, words)],
            env={**os.environ, "ODSCEN_WORKSPACE": str(self._workspace.root)},
            capture_output=True,
            check=False,
        )
        after = os.times()
        if said.returncode not in codes:
            raise RuntimeError(said.stderr.decode(errors="replace")[-2000:])
        seconds = after.children_user + after.children_system
        seconds -= before.children_user + before.children_system
        return Measured(seconds, len(said.stdout) + len(said.stderr))


class Routes:
    """What a page asks a server for about a scenario, with health asked for all the time."""

    LABELS = ("POST upload", "GET scenario", "POST edits", "GET plan")

    def __init__(self, address: str, process: int) -> None:
        self._address, self._process, self._number = address, psutil.Process(process), 0

    def use(self, document: grown.Document) -> Iterator[Measured]:
        self._number += 1
        name = f"size-{self._number}"
        content = json.dumps(document).encode()
        size = len(content)
        own = f"/api/scenarios/{name}"
        edit = json.dumps({"version": 1, "edits": [{"kind": "set_seed", "seed": 6}]}).encode()
        yield self._asked("POST", "/api/scenarios/upload", *form(content, name=name), size)
        yield self._asked("GET", own, None, None, size)
        yield self._asked("POST", f"{own}/edits", edit, "application/json", size)
        yield self._asked("GET", f"{own}/plan", None, None, size)

    def edits(self, document: grown.Document, edits: list[grown.Document]) -> Measured:
        """All in one request; one that takes too long is refused as a whole."""
        for _ in self.use(document):
            pass
        body = json.dumps({"version": 2, "edits": edits}).encode()
        path = f"/api/scenarios/size-{self._number}/edits"
        return self._asked("POST", path, body, "application/json", len(body))

    def table(self, document: grown.Document, kind: str, content: str) -> Measured:
        for _ in self.use(document):
            pass
        body, media = form(content.encode(), version="2", kind=kind)
        path = f"/api/scenarios/size-{self._number}/demand/table"
        return self._asked("POST", path, body, media, len(content))

    def _asked(
        self, method: str, path: str, body: bytes | None, media: str | None, size: int
    ) -> Measured:
        done, longest = threading.Event(), [0.0]

        def ask_for_health() -> None:
            while not done.is_set():
                begun = time.perf_counter()
                self._call("GET", "/api/health", None, None)
                longest[0] = max(longest[0], time.perf_counter() - begun)
                time.sleep(0.02)

        asking = threading.Thread(target=ask_for_health)
        asking.start()
        before = self._seconds()
        try:
            answer = self._call(method, path, body, media)
        finally:
            done.set()
            asking.join()
        return Measured(self._seconds() - before, max(answer - size, 0), longest[0])

    def _call(self, method: str, path: str, body: bytes | None, media: str | None) -> int:
        client = http.client.HTTPConnection(self._address, timeout=600)
        try:
            client.request(method, path, body, {} if media is None else {"Content-Type": media})
            answer = client.getresponse()
            content = answer.read()
        finally:
            client.close()
        if answer.status >= 500:
            raise RuntimeError(f"{method} {path}: {answer.status} {content[:500]!r}")
        return len(content)

    def _seconds(self) -> float:
        """CPU seconds of the server with all that it has started and waited for."""
        total = 0.0
        for process in (self._process, *self._process.children(recursive=True)):
            try:
                times = process.cpu_times()
            except psutil.Error:
                continue
            total += times.user + times.system
            total += getattr(times, "children_user", 0.0) + getattr(times, "children_system", 0.0)
        return total


def form(content: bytes, **fields: str) -> tuple[bytes, str]:
    """A form with a file, and its media type."""
    parts = [b'--b\r\nContent-Disposition: form-data; name="file"; filename="f.json"\r\n\r\n']
    parts += [content, b"\r\n"]
    for name, value in fields.items():
        head = f'--b\r\nContent-Disposition: form-data; name="{name}"\r\n\r\n{value}\r\n'
        parts.append(head.encode())
    return b"".join([*parts, b"--b--"]), "multipart/form-data; boundary=b"


def exponent(measured: Sequence[Measured]) -> float | None:
    """Of the growth from the smallest to the largest; ``None`` where all is noise."""
    least, *grown_by = (each.seconds for each in measured)
    first, last = grown_by[0] - least, grown_by[-1] - least
    if last <= NOISE:
        return None
    return math.log(last / max(first, NOISE / 8)) / math.log(FACTORS[len(grown_by) - 1])


def show(kind: str, label: str, number: int, measured: Sequence[Measured]) -> None:
    steep = exponent(measured)
    seconds = [each.seconds for each in measured[1:]]
    size = max(each.size for each in measured)
    health = max(each.health for each in measured)
    # Longer than it has computed it cannot have kept anybody waiting: the rest is the machine's.
    held_up = max(min(each.health, each.seconds) for each in measured)
    wrong = [
        words
        for words, is_wrong in (
            ("GROWS", (steep or 0.0) > STEEPEST and seconds[-1] > SECONDS),
            ("LONG ANSWER", size > ANSWER),
            ("HEALTH", held_up > HEALTH),
        )
        if is_wrong
    ]
    print(
        f"| {kind} | {label} | {number:,} | {', '.join(f'{each:.2f}' for each in seconds)} "
        f"| {'flat' if steep is None else f'{steep:.2f}'} | {size / 1e3:,.0f} "
        f"| {f'{health:.2f}' if health else ''} | {', '.join(wrong) or 'held'} |",
        flush=True,
    )
