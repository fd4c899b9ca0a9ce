import json
import subprocess
import sys
from pathlib import Path
from typing import Any, NamedTuple

import pytest

from odscen.maps.store import Workspace

SHIPPED = Path(__file__).parents[2] / "maps"


class Finished(NamedTuple):
    code: int
    out: str
    err: str

    @property
    def json(self) -> Any:
        return json.loads(self.out)


def odscen(*arguments: object, cwd: Path | None = None) -> Finished:
    """Run the command line as a user does, in a process of its own."""
    done = subprocess.run(
        [sys.executable, "-m", "odscen", *map(str, arguments)],
        capture_output=True,
        text=True,
        check=False,
        cwd=cwd,
        timeout=300,
    )
    return Finished(done.returncode, done.stdout, done.stderr)


@pytest.fixture(scope="session")
def workspace(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Workspace with two small maps; tests that change it make their own."""
    root = tmp_path_factory.mktemp("workspace")
    store = Workspace.open(root)
    for name in ("signal_crossing", "t_junction_signs"):
        store.add_map(SHIPPED / f"{name}.xodr")
    return root
