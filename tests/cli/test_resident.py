"""Commands carried out by a process that has done its imports, as their users see them."""

import os
import shutil
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import pytest

from tests.cli.conftest import odscen

MARK = "ODSCEN_TEST_OF_RESIDENT"
SERVER = b"odscen.cli.resident.server"
PATIENCE = 60.0

pytestmark = pytest.mark.skipif(
    not sys.platform.startswith("linux"), reason="there is no such process elsewhere"
)


@pytest.fixture
def environment(tmp_path):
    """Variables with which a process stays for a minute, that no other test has."""
    mine = {**os.environ, "ODSCEN_RESIDENT": "1", MARK: str(tmp_path)}
    yield mine
    for pid in those_of(tmp_path):
        os.kill(pid, signal.SIGKILL)


def those_of(mark, *, words=SERVER):
    """Processes with the mark and words in their command line."""
    found = []
    for folder in Path("/proc").iterdir():
        if folder.name.isdigit():
            try:
                marked = f"{MARK}={mark}".encode() in (folder / "environ").read_bytes()
                command = (folder / "cmdline").read_bytes()
                state = (folder / "stat").read_text().rpartition(")")[2].split()[0]
            except OSError:
                continue
            if marked and words in command and state != "Z":
                found.append(int(folder.name))
    return found


def wait_until(true):
    end = time.monotonic() + PATIENCE
    while not true():
        assert time.monotonic() < end
        time.sleep(0.02)


def is_ready(tmp_path):
    return len(those_of(tmp_path)) >= 2  # the one that stays, and the one that waits


def call(environment, *arguments, cwd=None):
    return subprocess.run(
        [sys.executable, "-m", "odscen", *map(str, arguments)],
        capture_output=True,
        text=True,
        env=environment,
        cwd=cwd,
        check=False,
    )


def was_handed_over(environment, *arguments):
    """Whether a command does not import what carries it out; Python says what it imports."""
    done = call({**environment, "PYTHONPROFILEIMPORTTIME": "1"}, *arguments)
    return "odscen.cli.commands" not in done.stderr


def tree(folder, *, but=()):
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in folder.rglob("*")
        if path.is_file() and path.name not in but
    }


@pytest.fixture
def ready(environment, tmp_path, workspace):
    """The variables, with a process that stays; Python says what it imports."""
    profiled = {**environment, "PYTHONPROFILEIMPORTTIME": "1"}
    assert call(profiled, "maps", "list", "--workspace", workspace).returncode == 0
    wait_until(lambda: is_ready(tmp_path))
    return profiled


def test_runs_have_the_same_bytes_and_words(environment, tmp_path, workspace):
    w = ("--workspace", workspace)
    odscen("generate", "--map", "signal_crossing", "--fill", "0.3", "--out", tmp_path / "s", *w)
    (scenario,) = (tmp_path / "s").glob("*.scenario.json")
    plain = {name: value for name, value in environment.items() if name != "ODSCEN_RESIDENT"}
    said = []
    for number, variables in enumerate((plain, environment, environment, environment)):
        folder = tmp_path / f"r{number}"
        folder.mkdir()
        done = call(variables, "run", scenario, "--until", "30", "--out", ".", *w, cwd=folder)
        said.append((done.returncode, done.stdout, done.stderr))
        if variables is environment:
            wait_until(lambda: is_ready(tmp_path))
    assert said == said[:1] * 4
    # Wall-clock figures are in these, see docs/runs.md.
    times = ("summary.json", "report.html", "SHA256SUMS")
    first = tree(tmp_path / "r0", but=times)
    assert len(first) > 15
    assert [tree(tmp_path / f"r{number}", but=times) == first for number in (1, 2, 3)] == [True] * 3


def test_a_command_is_handed_over_with_its_folder_streams_and_exit_code(
    environment, tmp_path, workspace
):
    profiled = {**environment, "PYTHONPROFILEIMPORTTIME": "1"}
    plain = {name: value for name, value in environment.items() if name != "ODSCEN_RESIDENT"}
    assert not was_handed_over(environment, "maps", "list", "--workspace", workspace)
    wait_until(lambda: is_ready(tmp_path))
    assert was_handed_over(environment, "maps", "list", "--workspace", workspace)
    (tmp_path / "here").mkdir()
    for arguments in (
        ("maps", "show", "signal_crossing", "--workspace", workspace),
        ("maps", "list", "--json", "--workspace", workspace),
        ("check", "no.scenario.json", "--json", "--workspace", workspace),
        ("maps", "show", "--nothing"),
    ):
        expected = call(plain, *arguments, cwd=tmp_path / "here")
        wait_until(lambda: is_ready(tmp_path))
        done = call(profiled, *arguments, cwd=tmp_path / "here")
        assert (done.returncode, done.stdout) == (expected.returncode, expected.stdout)
        words = [row for row in done.stderr.splitlines() if not row.startswith("import time:")]
        assert words == expected.stderr.splitlines()


def test_another_environment_has_a_process_of_its_own(ready, tmp_path, workspace):
    other = {**ready, "ODSCEN_WORKSPACE": str(tmp_path / "empty")}
    assert "signal_crossing" not in call(other, "maps", "list").stdout
    assert "signal_crossing" in call(ready, "maps", "list", "--workspace", workspace).stdout
    assert (
        "signal_crossing"
        in call({**ready, "ODSCEN_WORKSPACE": str(workspace)}, "maps", "list").stdout
    )


def test_a_package_that_has_come_is_seen(environment, tmp_path, workspace):
    packages = tmp_path / "packages"
    packages.mkdir()
    variables = {**environment, "PYTHONPATH": str(packages)}
    profiled = {**variables, "PYTHONPROFILEIMPORTTIME": "1"}
    call(profiled, "maps", "list", "--workspace", workspace)
    wait_until(lambda: is_ready(tmp_path))
    assert was_handed_over(variables, "maps", "list", "--workspace", workspace)
    wait_until(lambda: is_ready(tmp_path))
    (packages / "new.py").touch()
    assert not was_handed_over(variables, "maps", "list", "--workspace", workspace)


@pytest.mark.parametrize(
    ("number", "at_start"),
    [
        (signal.SIGINT, signal.default_int_handler),
        (signal.SIGTERM, signal.SIG_DFL),
        (signal.SIGTERM, signal.SIG_IGN),  # as services may start it; heeded as by any command
        (signal.SIGKILL, signal.SIG_DFL),
    ],
)
def test_a_signal_ends_what_was_handed_over(ready, tmp_path, workspace, number, at_start):
    heeded = signal.SIGINT if number == signal.SIGKILL else number
    before = signal.signal(heeded, at_start)  # it may be ignored here, and is inherited
    w = ("--workspace", workspace)
    odscen("generate", "--map", "signal_crossing", "--fill", "0.3", "--out", tmp_path / "s", *w)
    runs = tmp_path / "r"
    command = [sys.executable, "-m", "odscen", "run", tmp_path / "s", "--out", runs, *w]
    with subprocess.Popen(
        [*command, "--step-length", "0.01"], stderr=subprocess.PIPE, env=ready, text=True
    ) as process:
        while process.poll() is None and not list(runs.glob(".building-*/trajectories.parquet")):
            time.sleep(0.01)
        process.send_signal(number)
        _, err = process.communicate(timeout=PATIENCE)
    signal.signal(heeded, before)
    assert process.returncode == (-signal.SIGKILL if number == signal.SIGKILL else 130)
    assert "Traceback" not in err
    wait_until(lambda: not list(runs.glob("*")))
    # Nothing of the run is left; that which waits may have one ready for the next.
    wait_until(lambda: len(those_of(tmp_path)) == 2)


def test_it_ends_when_no_command_comes(environment, tmp_path, workspace):
    call({**environment, "ODSCEN_RESIDENT": "0.02"}, "maps", "list", "--workspace", workspace)
    wait_until(lambda: those_of(tmp_path))
    wait_until(lambda: not those_of(tmp_path))
    assert not those_of(tmp_path, words=b"odscen")


def test_minutes_that_are_none_are_refused(environment):
    for text in ("soon", "-1", "inf", "nan", "2000"):
        done = call({**environment, "ODSCEN_RESIDENT": text}, "maps", "list")
        assert done.returncode == 2
        assert f"ODSCEN_RESIDENT: must be a number of minutes from 0 to 1440, and is '{text}'" in (
            done.stderr
        )


def test_a_command_that_nothing_has_answered_is_not_carried_out_twice(ready, tmp_path, workspace):
    stopped = those_of(tmp_path)
    for pid in stopped:
        os.kill(pid, signal.SIGSTOP)
    given = ("generate", "--map", "signal_crossing", "--out", tmp_path / "s")
    assert call(ready, *given, "--workspace", workspace).returncode == 0
    shutil.rmtree(tmp_path / "s")
    for pid in stopped:
        os.kill(pid, signal.SIGCONT)
    assert was_handed_over(ready, "maps", "list", "--workspace", workspace)
    assert not (tmp_path / "s").exists()


def test_a_damaged_request_is_no_command_and_the_next_one_is(ready, tmp_path, workspace):
    (rows,) = {
        row.split()[-1]
        for pid in those_of(tmp_path)
        for row in Path("/proc/net/unix").read_text().splitlines()
        if "@odscen-resident-" in row
        and f"socket:[{row.split()[6]}]"
        in {str(link.readlink()) for link in Path(f"/proc/{pid}/fd").iterdir()}
    }
    for data in (b"", b"\0\0", b"\xff\xff\xff\xffx", b"\0\0\0\2[]", b"\0\0\0\2{}"):
        with socket.socket(socket.AF_UNIX) as connection:
            connection.connect("\0" + rows[1:])
            connection.sendall(data)
    assert was_handed_over(ready, "maps", "list", "--workspace", workspace)


@pytest.mark.usefixtures("ready")
def test_none_waits_when_the_process_that_stays_was_killed(tmp_path):
    os.kill(min(those_of(tmp_path)), signal.SIGKILL)
    wait_until(lambda: not those_of(tmp_path))


def test_what_cannot_be_written_ends_as_always(ready, workspace):
    plain = {name: value for name, value in ready.items() if name != "ODSCEN_RESIDENT"}
    command = [sys.executable, "-m", "odscen", "maps", "list", "--workspace", workspace]
    ends = []
    for variables in (plain, ready):
        with Path("/dev/full").open("w") as full:
            done = subprocess.run(
                command, stdout=full, stderr=subprocess.PIPE, env=variables, check=False
            )
        words = [row for row in done.stderr.splitlines() if not row.startswith(b"import time:")]
        ends.append((done.returncode, words))
    assert ends[0] == ends[1]
    assert ends[0][0] != 0
