"""Carries out the steps of the Dockerfile without a container engine.

``python -m tools.container_steps`` lays out the build context as ``.dockerignore`` has it, carries
out the steps of both stages with pip in an environment of its own, runs the demo, starts the page
as the image does, asks it, runs the health check, and prints sizes. What concerns the system
(packages of Debian, users) is left out; each such step is said.
"""

from __future__ import annotations

import fnmatch
import http.client
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[1]
SYSTEM = ("apt-get", "useradd")
"""How steps begin that only a container may take."""
TOKEN = "a-token-of-this-trial-alone"
_PATIENCE = 60.0


class Instruction(NamedTuple):
    """One of a Dockerfile; ``words`` is what follows its name, lines joined."""

    name: str
    words: str


def instructions(text: str) -> list[Instruction]:
    """Instructions of a Dockerfile, in order."""
    lines = [line for line in text.splitlines() if not line.lstrip().startswith("#")]
    joined = "\n".join(lines).replace("\\\n", " ")
    found = []
    for line in joined.splitlines():
        if line.strip():
            name, _, words = line.strip().partition(" ")
            found.append(Instruction(name.upper(), " ".join(words.split())))
    return found


def context_files(ignored: str, files: list[str]) -> list[str]:
    """Which of some files are sent: the last pattern of ``.dockerignore`` that fits decides."""
    patterns = [
        line.strip() for line in ignored.splitlines() if line.strip() and not line.startswith("#")
    ]

    def fits(file: str, pattern: str) -> bool:
        parts = Path(file).parts
        heads = ["/".join(parts[:end]) for end in range(1, len(parts) + 1)]
        if pattern.startswith("**/"):
            return any(fnmatch.fnmatchcase(part, pattern[3:]) for part in parts)
        return any(
            head.count("/") == pattern.count("/") and fnmatch.fnmatchcase(head, pattern)
            for head in heads
        )

    def is_sent(file: str) -> bool:
        sent = True
        for pattern in patterns:
            if fits(file, pattern.removeprefix("!")):
                sent = pattern.startswith("!")
        return sent

    return [file for file in files if is_sent(file)]


def committed_files() -> list[str]:
    """Files of the repository that git knows, from its root."""
    command = [
        "git",
        "-C",
        str(ROOT),
        "ls-files",
        "-z",
        "--cached",
        "--others",
        "--exclude-standard",
    ]
    text = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    return sorted(file for file in text.split("\0") if file and (ROOT / file).is_file())


def main() -> None:
    with tempfile.TemporaryDirectory(prefix="odscen-container-") as name:
        folder = Path(name)
        _try_steps(folder)


def _try_steps(folder: Path) -> None:
    build, venv = folder / "build", folder / "venv"
    sent = context_files((ROOT / ".dockerignore").read_text(), committed_files())
    for file in sent:
        (build / file).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy2(ROOT / file, build / file)
    print(f"context: {len(sent)} files, {_size_of(build):.1f} MB")
    subprocess.run([sys.executable, "-m", "venv", venv], check=True)
    own = {
        **os.environ,
        "PATH": f"{venv / 'bin'}{os.pathsep}{os.environ['PATH']}",
        "VIRTUAL_ENV": str(venv),
    }
    found = instructions((ROOT / "Dockerfile").read_text())
    for step in found:
        if step.name != "RUN":
            continue
        command = " ".join(w for w in step.words.split(" ") if not w.startswith("--mount="))
        if command.split(" ")[0] in SYSTEM:
            print(f"left out: {command}")
            continue
        if "slim_sumo" in command:
            install, slim = command.split(" && ")
            _run_step(install, build, own)
            print(f"installed: {_size_of(venv / 'lib'):.0f} MB")
            _run_step(slim, build, own)
            print(f"slimmed: {_size_of(venv / 'lib'):.0f} MB")
        else:
            _run_step(command, build, own)
    entry = json.loads(next(step.words for step in found if step.name == "ENTRYPOINT"))
    command = json.loads(next(step.words for step in found if step.name == "CMD"))
    own |= {"ODSCEN_WORKSPACE": str(folder / "workspace"), "ODSCEN_TOKEN": TOKEN}
    subprocess.run([*entry, "demo", "--workspace", str(folder / "demo")], env=own, check=True)
    health = next(step.words for step in found if step.name == "HEALTHCHECK")
    _ask_page([str(venv / "bin" / entry[0]), *command, "--port", "0"], health, own)


def _run_step(command: str, build: Path, own: dict[str, str]) -> None:
    here = command.replace("/build/", f"{build}/")
    began = time.monotonic()
    subprocess.run(["sh", "-c", here], cwd=build, env=own, check=True)
    print(f"{time.monotonic() - began:.0f} s: {command}")


def _ask_page(command: list[str], health: str, own: dict[str, str]) -> None:
    """Start the page as the image does, see who is let in, and stop it as an engine does."""
    with subprocess.Popen(command, env=own, stderr=subprocess.PIPE, text=True) as server:
        try:
            line = "" if server.stderr is None else server.stderr.readline()
            port = int(line.split("127.0.0.1:")[1].split("/")[0])
            key = {"Authorization": f"Bearer {TOKEN}"}
            for path, heads, wanted, words in (
                ("/", {}, 401, ""),
                ("/", key, 200, "<!doctype html>"),
                ("/api/maps", {}, 401, ""),
                ("/api/maps", key, 200, "["),
            ):
                status, text = _ask(port, path, heads)
                if status != wanted or not text.lower().startswith(words):
                    sys.exit(f"{path} is answered with {status}, not {wanted}: {text[:200]}")
                print(f"{path} {'with' if heads else 'without'} its token: {status}, {len(text)} B")
            look = json.loads(health[health.index("[") :])
            look[-1] = look[-1].replace("8420", str(port))
            subprocess.run(look, env=own, check=True)
            print("the health check finds the page")
        finally:
            server.terminate()
    print(f"stopped with {server.returncode}")


def _ask(port: int, path: str, heads: dict[str, str]) -> tuple[int, str]:
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=_PATIENCE)
    connection.request("GET", path, headers=heads)
    answer = connection.getresponse()
    return answer.status, answer.read().decode("utf-8", "replace")


def _size_of(folder: Path) -> float:
    """MB of files, those with two names counted once."""
    found = {}
    for path in folder.rglob("*"):
        if path.is_file() and not path.is_symlink():
            known = path.stat()
            found[known.st_ino] = known.st_size
    return sum(found.values()) / 1e6


if __name__ == "__main__":
    main()
