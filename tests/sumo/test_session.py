from __future__ import annotations

import json
import subprocess
import sys
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from pathlib import Path

# libsumo is one global simulation, so each of these runs in a process of its own.
PRELUDE = """
import json, sys
from pathlib import Path
from odscen.errors import SimulationError
from odscen.sumo.output_capture import captured_output
from odscen.sumo.session import open_session
net = sys.argv[1]
"""


def run_script(body: str, *arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-c", PRELUDE + body, *arguments],
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )


def test_a_second_session_is_refused_and_the_first_lives_on(grid: Path) -> None:
    result = run_script(
        """
with open_session(["-n", net, "--xml-validation", "never"]) as session:
    session.step()
    try:
        with open_session(["-n", net]):
            pass
    except SimulationError as error:
        refused = str(error)
    session.step()
    print(json.dumps({"refused": refused, "time": session.time}))
""",
        str(grid),
    )
    said = json.loads(result.stdout)
    assert "already" in said["refused"]
    assert said["time"] == 2.0


def test_a_session_can_follow_one_that_was_closed_by_an_error(grid: Path) -> None:
    result = run_script(
        """
try:
    with open_session(["-n", net, "--xml-validation", "never"]) as session:
        session.step()
        raise ValueError("ours")
except ValueError:
    pass
with open_session(["-n", net, "--xml-validation", "never"]) as session:
    print(json.dumps(session.time))
""",
        str(grid),
    )
    assert json.loads(result.stdout) == 0.0


def test_a_refused_start_is_a_simulation_error_and_sumos_words_are_in_the_log(
    tmp_path: Path,
) -> None:
    log = tmp_path / "sumo.log"
    result = run_script(
        """
with captured_output(Path(sys.argv[2])) as stdout:
    try:
        with open_session(["-n", net]):
            pass
    except SimulationError as error:
        stdout.write(json.dumps(str(error)))
""",
        str(tmp_path / "missing.net.xml"),
        str(log),
    )
    assert "refused to start" in json.loads(result.stdout)
    assert result.stderr == ""
    assert "missing.net.xml" in log.read_text()


@pytest.mark.skipif(sys.platform == "win32", reason="descriptors are checked through /bin/sh")
def test_output_of_child_programs_is_captured_too_and_restored_afterwards(tmp_path: Path) -> None:
    log = tmp_path / "log"
    result = run_script(
        """
import os
with captured_output(Path(net)) as stdout:
    os.system("echo from below; echo and below >&2")
    stdout.write("message\\n")
os.system("echo after")
""",
        str(log),
    )
    assert result.stdout == "message\nafter\n"
    assert log.read_text() == "from below\nand below\n"


def test_importing_libsumo_prints_nothing_to_stdout_even_where_it_would(tmp_path: Path) -> None:
    (tmp_path / "libsumo").mkdir()
    (tmp_path / "libsumo" / "__init__.py").write_text("import os\nos.write(1, b'Warning!')\n")
    result = run_script(
        """
sys.path.insert(0, sys.argv[1])
from odscen.sumo.session import import_libsumo
import_libsumo()
print("clean")
""",
        str(tmp_path),
    )
    assert result.stdout == "clean\n"
    assert result.stderr == "Warning!"
