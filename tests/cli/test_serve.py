import re
import signal
import subprocess
import sys
import urllib.error
import urllib.request
from contextlib import contextmanager

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
    with urllib.request.urlopen(url, timeout=20) as answer:
        return answer.status, answer.read().decode()


def test_serve_answers_on_this_machine_until_it_is_interrupted(tmp_path):
    with served("--workspace", str(tmp_path)) as process:
        address = re.search(r"http://\S+", process.stderr.readline())[0]
        assert address.startswith("http://127.0.0.1:")
        assert "token" not in address
        assert get(address + "api/health")[0] == 200
        process.send_signal(signal.SIGINT)
        process.wait(timeout=20)
        assert "Traceback" not in process.stderr.read()


def test_any_other_address_needs_the_token_that_is_printed(tmp_path):
    with served("--host", "0.0.0.0", "--workspace", str(tmp_path)) as process:
        address = re.search(r"http://\S+", process.stderr.readline())[0]
        page, token = address.split("?token=")
        assert len(token) > 20
        with pytest.raises(urllib.error.HTTPError, match="401"):
            get(page + "api/health")
        request = urllib.request.Request(
            page + "api/health", headers={"Authorization": f"Bearer {token}"}
        )
        assert get(request)[0] == 200


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
