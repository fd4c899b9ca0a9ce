"""Runs, and what users do with NumPy, in several threads of a process that has just begun."""

from __future__ import annotations

import subprocess
import sys
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from pathlib import Path

    from odscen.maps.store import Workspace

IN_THREADS = """
import sys, threading
from pathlib import Path
import numpy as np
import odscen

failures, barrier = [], threading.Barrier(4)

def work(number):
    try:
        barrier.wait()
        {work}
    except Exception as error:
        failures.append(f"{{type(error).__name__}}: {{error}}")

threads = [threading.Thread(target=work, args=(k,)) for k in range(4)]
for thread in threads: thread.start()
for thread in threads: thread.join()
print(len(failures), failures)
"""


def failures_in_threads(work: str, *arguments: str) -> str:
    code = IN_THREADS.format(work=work)
    done = subprocess.run(
        [sys.executable, "-c", code, *arguments], capture_output=True, text=True, check=True
    )
    return done.stdout.strip()


def test_modules_of_other_packages_are_their_own_after_a_run_has_been_imported() -> None:
    code = (
        "import sys; from scipy.spatial import cKDTree; import odscen; odscen.run;"
        "import odscen.app.running.runs, odscen.lanegraph.shortest_paths;"
        "import odscen.figures.measures.conflicts;"
        "print([name for name, module in sys.modules.items()"
        " if name.partition('.')[0] in ('numpy', 'scipy', 'sumolib', 'libsumo')"
        " and (module.__spec__ is None or type(module).__name__ == '_LazyModule')])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


@pytest.mark.slow
@pytest.mark.parametrize("turn", [1, 2])
def test_numpy_works_in_threads_after_odscen_has_been_imported(turn: int) -> None:
    work = "odscen.run; from odscen.lanegraph import shortest_paths; np.unique(np.arange(9) // 2)"
    assert failures_in_threads(work, str(turn)) == "0 []"


@pytest.mark.slow
@pytest.mark.parametrize("turn", [1, 2, 3, 4])
def test_four_threads_run_a_scenario_at_the_same_time(
    workspace: Workspace, sampled: Path, tmp_path: Path, turn: int
) -> None:
    work = (
        "odscen.run(odscen.Workspace.open(Path(sys.argv[1])), Path(sys.argv[2]),"
        " out=Path(sys.argv[3], str(number)),"
        " settings=odscen.RunSettings(until=2.0, seed=number))"
    )
    places = map(str, (workspace.root, sampled, tmp_path / f"turn-{turn}"))
    assert failures_in_threads(work, *places) == "0 []"
