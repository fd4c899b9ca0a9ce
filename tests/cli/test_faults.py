"""Full disks, read-only folders, too few handles, too little memory, and several at once."""

import json
import os
import resource
import shutil
import signal
import subprocess
import sys
import time
from contextlib import contextmanager

import pytest

from tests.cli.conftest import Finished, odscen

pytestmark = pytest.mark.skipif(os.name == "nt", reason="POSIX signals and limits")
RESULTS = ("actors.json", "events.json", "trajectories/part-0001.parquet")


@pytest.fixture(scope="module")
def scenario(workspace, tmp_path_factory):
    out = tmp_path_factory.mktemp("s")
    odscen("generate", "--map", "signal_crossing", "--fill", "0.3", "--out", out,
           "--workspace", workspace)  # fmt: skip
    return next(out.iterdir())


@pytest.fixture(scope="module")
def long_run(workspace, scenario):
    """Arguments of a run of 60 s in six slices; its steps are short, so that it takes a while."""
    return ("run", scenario, "--step-length", "0.05", "--slice", "10s", "--until", "60",
            "--workspace", workspace)  # fmt: skip


@pytest.fixture(scope="module")
def alone(long_run, tmp_path_factory):
    out = tmp_path_factory.mktemp("alone")
    assert odscen(*long_run, "--out", out).code == 0
    return next(path for path in out.iterdir())


def start(*arguments, **options):
    return subprocess.Popen(
        [sys.executable, "-m", "odscen", *map(str, arguments)],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **options,
    )  # fmt: skip


def wait_for(path, process):
    while process.poll() is None and not path.exists():
        time.sleep(0.01)
    assert process.poll() is None


def run_folder(out, scenario):
    return out / scenario.name.removesuffix(".scenario.json")


def end_of(process) -> Finished:
    out, err = process.communicate(timeout=300)
    assert "Traceback" not in err
    return Finished(process.returncode, out, err)


def assert_resumes(run, workspace, alone):
    done = odscen("resume", run, "--workspace", workspace)
    assert done.code == 0, done.err
    for name in RESULTS:
        assert (run / name).read_bytes() == (alone / name).read_bytes()


@pytest.mark.slow
def test_of_three_simultaneous_runs_into_one_folder_one_runs_and_two_say_who_holds_it(
    scenario, long_run, alone, tmp_path
):
    processes = [start(*long_run, "--out", tmp_path) for _ in range(3)]
    done = {process.pid: end_of(process) for process in processes}
    assert sorted(one.code for one in done.values()) == [0, 2, 2]
    (winner,) = (pid for pid, one in done.items() if one.code == 0)
    for one in done.values():
        if one.code:
            assert f"is in the hands of process {winner} since 20" in one.err
    assert [path.name for path in tmp_path.iterdir()] == [run_folder(tmp_path, scenario).name]
    for name in RESULTS:
        assert (run_folder(tmp_path, scenario) / name).read_bytes() == (alone / name).read_bytes()


@pytest.mark.slow
def test_sigterm_ends_a_run_as_ctrl_c_does_and_it_resumes(
    workspace, scenario, long_run, alone, tmp_path
):
    run = run_folder(tmp_path, scenario)
    process = start(*long_run, "--out", tmp_path)
    wait_for(run / "slices" / "0002", process)
    process.send_signal(signal.SIGTERM)
    done = end_of(process)
    assert done.code == 130
    assert f"odscen resume {run}" in done.err
    assert [path.name for path in tmp_path.iterdir()] == [run.name]
    assert_resumes(run, workspace, alone)


@pytest.mark.slow
def test_sigterm_leaves_nothing_of_a_run_in_one_piece(workspace, scenario, tmp_path):
    process = start("run", scenario, "--step-length", "0.01", "--out", tmp_path,
                    "--workspace", workspace)  # fmt: skip
    while process.poll() is None and not list(tmp_path.glob(".building-*/trajectories.parquet")):
        time.sleep(0.01)
    process.send_signal(signal.SIGTERM)
    assert end_of(process).code == 130
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
def test_what_a_killed_run_in_one_piece_leaves_is_cleared_by_the_next(
    workspace, scenario, tmp_path
):
    process = start("run", scenario, "--step-length", "0.01", "--out", tmp_path,
                    "--workspace", workspace)  # fmt: skip
    while process.poll() is None and not list(tmp_path.glob(".building-*/trajectories.parquet")):
        time.sleep(0.01)
    process.kill()
    process.communicate()
    assert len(list(tmp_path.iterdir())) == 2
    done = odscen("run", scenario, "--until", "1", "--out", tmp_path, "--workspace", workspace)
    assert done.code == 0, done.err
    assert [path.name for path in tmp_path.iterdir()] == [run_folder(tmp_path, scenario).name]


@contextmanager
def small_disk(folder, size):
    """A file system of so many bytes."""
    folder.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", f"size={size}", "tmpfs", folder]
    if shutil.which("mount") is None or subprocess.run(mount, check=False).returncode:
        pytest.skip("file systems may not be mounted here")
    try:
        yield folder
    finally:
        subprocess.run(["umount", folder], check=True)


@pytest.mark.slow
def test_a_full_disk_is_named_with_what_to_do_and_the_run_resumes(
    workspace, scenario, long_run, alone, tmp_path
):
    with small_disk(tmp_path / "disk", 40_000_000) as disk:
        run = run_folder(disk / "r", scenario)
        process = start(*long_run, "--out", disk / "r")
        wait_for(run / "slices" / "0001", process)
        ballast = disk / "ballast"
        with ballast.open("wb", buffering=0) as file:
            while True:
                try:
                    file.write(bytes(4096))
                except OSError:
                    break
        done = end_of(process)
        assert done.code == 3
        assert "the disk is full; free some room" in done.err
        assert f"odscen resume {run}" in done.err
        ballast.unlink()
        assert_resumes(run, workspace, alone)


@pytest.mark.slow
def test_a_folder_that_may_not_be_written_is_named_with_what_to_do(workspace, scenario, tmp_path):
    """Root writes anywhere, but not into a file system that is mounted read-only."""
    with small_disk(tmp_path / "disk", 1_000_000) as disk:
        subprocess.run(["mount", "-o", "remount,ro", disk], check=True)
        done = odscen("run", scenario, "--out", disk / "r", "--workspace", workspace)
        assert done.code == 3
        assert "nothing may be written here; make it writable, or name another folder" in done.err


@pytest.mark.slow
def test_a_run_on_a_read_only_disk_is_not_resumed_and_says_why_and_resumes_later(
    workspace, scenario, long_run, alone, tmp_path
):
    with small_disk(tmp_path / "disk", 40_000_000) as disk:
        run = run_folder(disk / "r", scenario)
        process = start(*long_run, "--out", disk / "r")
        wait_for(run / "slices" / "0002", process)
        process.send_signal(signal.SIGTERM)
        assert end_of(process).code == 130
        subprocess.run(["mount", "-o", "remount,ro", disk], check=True)
        done = odscen("resume", run, "--workspace", workspace)
        assert done.code == 3, done.err
        assert "nothing may be written here; make it writable" in done.err
        assert f"then: odscen resume {run}" in done.err
        subprocess.run(["mount", "-o", "remount,rw", disk], check=True)
        assert_resumes(run, workspace, alone)


@pytest.mark.slow
@pytest.mark.parametrize("handles", [8, 12, 20])
def test_too_few_handles_are_named_with_what_to_do(workspace, scenario, tmp_path, handles):
    def limit():
        resource.setrlimit(resource.RLIMIT_NOFILE, (handles, handles))

    process = start("run", scenario, "--until", "5", "--out", tmp_path / "r", "--json",
                    "--workspace", workspace, preexec_fn=limit)  # fmt: skip
    out, err = process.communicate(timeout=300)
    assert process.returncode in (0, 3), err
    if process.returncode == 3:
        assert "too many files are open" in err
        assert json.loads(out)


@pytest.mark.slow
def test_a_run_that_ends_before_its_first_step_is_refused(workspace, scenario, tmp_path):
    done = odscen("run", scenario, "--until", "1e-300", "--out", tmp_path, "--workspace", workspace)
    assert done.code == 2
    assert "until is 1e-300 s: the run would end before its first step (0.5 s)" in done.err
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
def test_doctor_tells_each_step_and_repairs(workspace, alone, tmp_path):
    run = tmp_path / "run"
    shutil.copytree(alone, run)
    (run / "report.html").write_text("", encoding="utf-8")
    found = odscen("doctor", run, "--json", "--workspace", workspace)
    assert found.code == 2
    (step,) = found.json["stored"]
    assert (step["what"], step["name"], step["action"]) == ("run", "run", "found")
    assert odscen("compare", run, alone, "--workspace", workspace).code == 2
    repaired = odscen("doctor", "--repair", run, "--workspace", workspace)
    assert repaired.code == 0, repaired.err
    assert "run run: rebuilt: report.html: expected sha256" in repaired.err
    assert odscen("compare", run, alone, "--workspace", workspace).code == 0


def test_a_signal_after_the_end_of_a_command_shows_nothing_of_python():
    script = (
        "import atexit, os, signal, sys\n"
        "atexit.register(os.kill, os.getpid(), signal.SIGTERM)\n"
        "sys.argv = ['odscen', 'assets', 'list']\n"
        "from odscen.cli import main\n"
        "main()\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=False
    )
    assert done.returncode in (0, -signal.SIGTERM)
    assert done.stderr == ""


@pytest.mark.slow
def test_a_signal_where_python_cannot_raise_ends_a_command_all_the_same():
    script = (
        "import signal, time, weakref\n"
        "from odscen import cli\n"
        "from odscen.cli import commands\n"
        "class Thing: pass\n"
        "def app():\n"
        "    thing = Thing()\n"
        "    known = weakref.ref(thing, lambda _: signal.raise_signal(signal.SIGTERM))\n"
        "    del thing\n"
        "    time.sleep(30)\n"
        "    print('not interrupted')\n"
        "commands.command_line = lambda _: app\n"
        "cli.main()\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "")


@pytest.fixture(scope="module")
def short_run(workspace, scenario, tmp_path_factory):
    out = tmp_path_factory.mktemp("short")
    assert odscen("run", scenario, "--until", 2, "--workspace", workspace, "--out", out).code == 0
    return run_folder(out, scenario)


@pytest.mark.slow
def test_an_export_onto_a_full_disk_says_so_in_our_words(workspace, short_run, tmp_path):
    (tmp_path / f"{short_run.name}.npz").symlink_to("/dev/full")
    done = odscen("export", short_run, "--to", "pyg", "--workspace", workspace, "--out", tmp_path)
    assert done.code == 3
    assert done.err == f"error: {tmp_path}: the disk is full; free some room\n"


@pytest.mark.slow
@pytest.mark.parametrize("place", [{}, {"LC_ALL": "C", "PYTHONUTF8": "0"}])
def test_a_run_folder_whose_path_is_no_text_is_refused_before_anything_runs(
    workspace, scenario, tmp_path, place
):
    out = tmp_path / ("\u00e9" if place else os.fsdecode(b"r\xff"))
    command = [sys.executable, "-m", "odscen", "run", scenario, "--until", "2", "--json",
               "--workspace", workspace, "--out", out]  # fmt: skip
    done = subprocess.run(
        command, capture_output=True, text=True, check=False, env={**os.environ, **place}
    )
    assert done.returncode == 2
    assert "is no text in" in done.stderr
    assert "Traceback" not in done.stderr
    assert json.loads(done.stdout)["error"]["type"] == "InputError"
    assert not out.exists()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("streams", "code"),
    [("2>&-", 2), (">&- 2>&-", 2), ("2>/dev/full", 2), (">/dev/full", 2)],
)
def test_a_closed_or_full_stream_changes_no_exit_code(tmp_path, streams, code):
    words = f"{sys.executable} -m odscen run nothing.json --json {streams}"
    done = subprocess.run(["bash", "-c", words], capture_output=True, check=False, cwd=tmp_path)
    assert done.returncode == code
    assert b"Traceback" not in done.stderr


@pytest.mark.slow
def test_with_closed_streams_nothing_is_written_into_other_files(workspace, scenario, tmp_path):
    words = (
        f"{sys.executable} -m odscen run {scenario} --until 2 --workspace {workspace} "
        f"--out {tmp_path} <&- >&- 2>&-"
    )
    assert subprocess.run(["bash", "-c", words], check=False).returncode == 0
    sums = ["sha256sum", "--quiet", "-c", "SHA256SUMS"]
    run = run_folder(tmp_path, scenario)
    assert subprocess.run(sums, check=False, cwd=run).returncode == 0


@pytest.mark.slow
@pytest.mark.parametrize("command", ["run", "export", "compare"])
def test_too_little_address_space_is_said_before_a_library_aborts(
    workspace, scenario, short_run, tmp_path, command
):
    given = {
        "run": [scenario, "--until", "2", "--out", tmp_path / "runs"],
        "export": [short_run, "--to", "pyg", "--out", tmp_path / "out"],
        "compare": [short_run, short_run],
    }
    process = start(
        command, *given[command], "--workspace", workspace,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (10**9, 10**9)),
    )  # fmt: skip
    done = end_of(process)
    assert done.code == 3
    assert "this needs 2 GB of address space, and 1.0 GB are allowed here" in done.err
