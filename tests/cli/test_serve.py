import os
import re
import signal
import subprocess
import sys
import time
import urllib.error
import urllib.request
from contextlib import contextmanager
from pathlib import Path

import pytest

from tests.cli.conftest import odscen


@contextmanager
def served(*arguments):
    with subprocess.Popen(
        [sys.executable, "-m", "odscen", "serve", "--port", "0", "--no-browser", *arguments],
        stderr=subprocess.PIPE,
        text=True,
    ) as process:
        try:
            yield process
        finally:
            process.kill()


def get(url):
    with urllib.request.urlopen(url, timeout=90) as answer:
        return answer.status, answer.read().decode()


@pytest.mark.slow
def test_serve_answers_on_this_machine_until_it_is_interrupted(tmp_path):
    with served("--workspace", str(tmp_path)) as process:
        address = re.search(r"http://\S+", process.stderr.readline())[0]
        assert address.startswith("http://127.0.0.1:")
        page, token = address.split("?token=")
        assert get(bearing(page + "api/health", token))[0] == 200
        process.send_signal(signal.SIGINT)
        process.wait(timeout=90)
        assert "Traceback" not in process.stderr.read()


def bearing(url, token):
    return urllib.request.Request(url, headers={"Authorization": f"Bearer {token}"})


@pytest.mark.slow
def test_on_this_machine_too_the_token_is_needed_unless_it_is_declined(tmp_path):
    with served("--workspace", str(tmp_path)) as process:
        page = re.search(r"http://\S+/", process.stderr.readline())[0]
        with pytest.raises(urllib.error.HTTPError, match="401"):
            get(page + "api/health")
    with served("--no-token", "--workspace", str(tmp_path)) as process:
        address = re.search(r"http://\S+", process.stderr.readline())[0]
        assert "token" not in address
        assert get(address + "api/health")[0] == 200


@pytest.mark.slow
def test_the_token_stays_over_a_restart_until_a_new_one_is_wanted(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    tokens = []
    for options in ((), (), ("--new-token",)):
        with served("--workspace", str(tmp_path / "workspace"), *options) as process:
            page, token = re.search(r"http://\S+", process.stderr.readline())[0].split("?token=")
            tokens.append(token)
            # Who had the first token is let in after the restart.
            if len(tokens) == 2:
                assert get(bearing(page + "api/health", tokens[0]))[0] == 200
    assert tokens[0] == tokens[1] != tokens[2]


@pytest.mark.slow
def test_a_token_of_ones_own_comes_from_the_environment_and_stays(tmp_path, monkeypatch):
    monkeypatch.setenv("ODSCEN_TOKEN", "a-token-of-my-own")
    with served("--workspace", str(tmp_path)) as process:
        page, token = re.search(r"http://\S+", process.stderr.readline())[0].split("?token=")
        assert token == "a-token-of-my-own"
        assert get(bearing(page + "api/maps", token))[0] == 200


@pytest.mark.slow
@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--token", "short"), "16 to 256"),
        (("--token", "spaces; and more of it"), "16 to 256"),
        (("--no-token", "--host", "0.0.0.0"), "can be reached from others"),
    ],
)
def test_what_would_be_no_protection_is_refused(tmp_path, options, words):
    done = odscen("serve", "--port", "0", "--no-browser", "--workspace", tmp_path, *options)
    assert done.code == 2
    assert words in done.err


@pytest.mark.slow
def test_the_browser_is_started_with_a_private_file_and_never_with_the_token(tmp_path):
    seen = tmp_path / "seen"
    browser = tmp_path / "browser"
    browser.write_text(
        f"""#!{sys.executable}
import os, pathlib, sys, urllib.parse
file = pathlib.Path(urllib.parse.urlsplit(sys.argv[1]).path)
mode = oct(file.parent.stat().st_mode & 0o777)
pathlib.Path({str(seen)!r}).write_text("\\n".join([sys.argv[1], mode, file.read_text()]))
"""
    )
    browser.chmod(0o755)
    command = [sys.executable, "-m", "odscen", "serve", "--port", "0"]
    environment = {**os.environ, "BROWSER": str(browser)}
    with subprocess.Popen(
        [*command, "--workspace", str(tmp_path)], stderr=subprocess.PIPE, text=True,
        env=environment,
    ) as process:  # fmt: skip
        address = re.search(r"http://\S+", process.stderr.readline())[0]
        end = time.monotonic() + 120
        while not seen.exists() or len(seen.read_text()) < 50:
            assert time.monotonic() < end
            time.sleep(0.05)
        process.send_signal(signal.SIGINT)
        process.wait(timeout=90)
    called, mode, text = seen.read_text().split("\n", 2)
    assert called.startswith("file:///")
    assert "token" not in called
    assert mode == "0o700"
    assert address in text
    assert not Path(called.removeprefix("file://")).exists()


@pytest.mark.slow
def test_any_other_address_needs_the_token_that_is_printed(tmp_path):
    with served("--host", "0.0.0.0", "--workspace", str(tmp_path)) as process:
        address = re.search(r"http://\S+", process.stderr.readline())[0]
        page, token = address.split("?token=")
        assert len(token) > 20
        with pytest.raises(urllib.error.HTTPError, match="401"):
            get(page + "api/health")
        assert get(bearing(page + "api/health", token))[0] == 200


@pytest.mark.slow
def test_an_address_that_is_taken_is_told_with_a_way_out(tmp_path):
    with served("--workspace", str(tmp_path)) as process:
        port = re.search(r":(\d+)/", process.stderr.readline())[1]
        done = odscen("serve", "--port", port, "--no-browser", "--workspace", tmp_path)
        assert done.code == 2
        assert "--port" in done.err


def test_help_does_not_import_the_web_framework():
    script = (
        "import sys; sys.argv = ['odscen', '--help']\n"
        "from odscen.cli import main\n"
        "try: main()\n"
        "except SystemExit: pass\n"
        "print(sorted({'fastapi', 'starlette', 'uvicorn', 'numpy'} & set(sys.modules)))"
    )
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True
    )
    assert done.stdout.splitlines()[-1] == "[]"
