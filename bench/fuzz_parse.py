"""Damaged .xodr files against a command: each must end in success or a clear refusal.

Every copy runs in a process of its own with 10 s and 1 GiB. By default the process parses the file,
evaluates all lanes and follows all links; ``--command`` takes any other command line, in which
``{file}`` stands for the damaged file and ``{dir}`` for an empty folder, for example
``--command "odscen maps add {file} --workspace {dir}"``. Exit codes 0 (success) and 2 (refused)
pass; anything else is a failure.

    python -m bench.fuzz_parse --count 1000
"""

from __future__ import annotations

import argparse
import resource
import shlex
import subprocess
import sys
import tempfile
import time
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import NamedTuple

from bench.common import OUT, shared_maps
from tests.opendrive.full import FULL
from tests.opendrive.mutate import mutations

TIME_LIMIT = 10.0
MEMORY_LIMIT = 1 << 30
PARSE = f"{shlex.quote(sys.executable)} -m bench.fuzz_parse --one {{file}}"
OUTCOMES = {0: "success", 2: "refused"}


class Case(NamedTuple):
    source: str
    number: int
    kind: str
    data: bytes


class Result(NamedTuple):
    case: Case
    outcome: str
    seconds: float
    words: str


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("--count", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--command", default=PARSE)
    parser.add_argument("--one", type=Path, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.one is not None:
        sys.exit(parse_one(options.one))
    cases = damaged(count=options.count, seed=options.seed)
    with ThreadPoolExecutor(options.jobs) as pool:
        results = list(pool.map(lambda case: run(case, options.command), cases))
    sys.exit(report(results))


def parse_one(path: Path) -> int:
    """What a damaged file goes through by default."""
    from odscen.base.errors import OdscenError
    from tests.opendrive.test_mutations import use_everything

    try:
        use_everything(path.read_bytes())
    except OdscenError as error:
        print(error, file=sys.stderr)
        return error.exit_code
    return 0


def damaged(*, count: int, seed: int) -> list[Case]:
    """Damaged copies of the small real maps, or of the test file where there are none."""
    maps = shared_maps()
    files = sorted((maps / "esmini").glob("*.xodr")) if maps else []
    texts = [("full", FULL.encode()), *((file.stem, file.read_bytes()) for file in files)]
    cases = []
    for k, (name, data) in enumerate(texts):
        share = count // len(texts) + (k < count % len(texts))
        damage = mutations(data, seed + k, share)
        cases += [Case(name, i, found.kind, found.data) for i, found in enumerate(damage)]
    return cases


def run(case: Case, command: str) -> Result:
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "map.xodr"
        file.write_bytes(case.data)
        work = Path(folder) / "work"
        work.mkdir()
        words = [part.format(file=file, dir=work) for part in shlex.split(command)]
        start = time.perf_counter()
        try:
            done = subprocess.run(
                words,
                capture_output=True,
                text=True,
                errors="replace",
                timeout=TIME_LIMIT,
                check=False,
                preexec_fn=_limit_memory,
            )
        except subprocess.TimeoutExpired:
            return Result(case, "TIME OUT", time.perf_counter() - start, "")
    outcome = OUTCOMES.get(done.returncode, f"FAILURE {done.returncode}")
    if "Traceback" in done.stderr:
        outcome = "TRACEBACK"
    return Result(case, outcome, time.perf_counter() - start, done.stderr.strip())


def _limit_memory() -> None:
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY_LIMIT, MEMORY_LIMIT))


def report(results: list[Result]) -> int:
    """Print a table by kind of damage; keep what failed; the number of failures."""
    outcomes = sorted({result.outcome for result in results})
    counts = Counter((result.case.kind, result.outcome) for result in results)
    print("damage".ljust(20), *(outcome.rjust(14) for outcome in outcomes))
    for kind in sorted({result.case.kind for result in results}):
        print(kind.ljust(20), *(str(counts[kind, outcome]).rjust(14) for outcome in outcomes))
    totals = Counter(result.outcome for result in results)
    print("all".ljust(20), *(str(totals[outcome]).rjust(14) for outcome in outcomes))
    print(f"slowest {max(result.seconds for result in results):.2f} s of {TIME_LIMIT:.0f} s")
    failures = [result for result in results if result.outcome not in OUTCOMES.values()]
    for result in failures:
        OUT.mkdir(exist_ok=True)
        kept = OUT / f"fuzz-{result.case.source}-{result.case.number}.xodr"
        kept.write_bytes(result.case.data)
        last = result.words.splitlines()[-1] if result.words else ""
        print(f"{result.outcome} {result.case.kind}: kept {kept.name}: {last}")
    return min(len(failures), 1)


if __name__ == "__main__":
    main()
