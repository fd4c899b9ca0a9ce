from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

from odscen.base.text_files import clear_parts, write_text


def test_what_a_killed_process_has_left_of_a_file_is_removed_and_nothing_else(
    tmp_path: Path,
) -> None:
    gone = subprocess.Popen([sys.executable, "-c", ""])
    gone.wait()
    history = tmp_path / ".history" / "one"
    history.mkdir(parents=True)
    dead = history / f".index.json.{gone.pid}.part"
    alive = tmp_path / f".a.scenario.json.{os.getpid()}.part"
    young = tmp_path / f".b.scenario.json.{gone.pid}.part"
    named = tmp_path / "notes.1.part"
    for file in (dead, alive, young, named):
        file.write_text("{")
    for file in (dead, alive, named):
        os.utime(file, (1e9, 1e9))
    kept = write_text(tmp_path / "c.scenario.json", "{}")
    clear_parts(tmp_path)
    assert sorted(path for path in tmp_path.rglob("*") if path.is_file()) == sorted(
        [alive, young, named, kept]
    )
