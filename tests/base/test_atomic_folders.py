from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

SCRIPT = """
import os, resource, sys
from pathlib import Path
from odscen.base.atomic_folders import new_folder
resource.setrlimit(resource.RLIMIT_NOFILE, (int(sys.argv[2]), 4096))
parent = Path(sys.argv[1])
held = []
try:
    with new_folder(parent / "map") as folder:
        (folder / "a" / "b" / "c").mkdir(parents=True)
        while True:
            held.append(os.open(folder, os.O_RDONLY))
except OSError as error:
    print(error.strerror)
"""


@pytest.mark.skipif(os.name == "nt", reason="POSIX limits")
@pytest.mark.parametrize("handles", [3, 4, 5, 8])
def test_nothing_is_left_of_a_folder_where_no_handle_is_left(tmp_path: Path, handles: int) -> None:
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT, tmp_path, str(handles)],
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout == "Too many open files\n"
    assert list(tmp_path.iterdir()) == []
