"""Commands that another Python carries out."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from odscen.base.errors import MissingDependencyError
from odscen.cli.other_python import carry_out_in, without_option

pytest.importorskip("carla")


def test_an_option_and_its_value_are_left_out_however_they_are_written() -> None:
    given = ["cosim", "--carla-python", "/p", "s.json", "--json"]
    assert without_option(given, "--carla-python") == ["cosim", "s.json", "--json"]
    assert without_option(["cosim", "--carla-python=/p", "s"], "--carla-python") == ["cosim", "s"]
    assert without_option(["cosim", "--carla", "h:1"], "--carla-python") == [
        "cosim", "--carla", "h:1",
    ]  # fmt: skip


@pytest.mark.slow
def test_the_other_python_carries_the_command_out_with_its_words_and_exit_code() -> None:
    words = ["--carla", "127.0.0.1:9", "--timeout", "0.5", "--selfcheck", "--json"]
    command = [sys.executable, "-m", "odscen", "cosim", *words]
    here = subprocess.run(command, capture_output=True, text=True, check=False)
    there = subprocess.run(
        [*command, "--carla-python", sys.executable], capture_output=True, text=True, check=False
    )
    assert "no CARLA server at 127.0.0.1:9" in there.stderr
    assert (there.returncode, there.stdout) == (here.returncode, here.stdout)
    assert there.returncode == 3


def test_a_python_without_odscen_or_the_client_is_named(tmp_path: Path) -> None:
    with pytest.raises(MissingDependencyError, match="cannot be started"):
        carry_out_in(tmp_path / "python", ["cosim"], package="carla")
    old = tmp_path / "old"
    old.write_text("#!/bin/sh\necho 0.0.1 0.9.16\n")
    bare = tmp_path / "bare"
    bare.write_text("#!/bin/sh\nexit 1\n")
    for file in (old, bare):
        file.chmod(0o755)
    with pytest.raises(
        MissingDependencyError, match=r"has odscen 0\.0\.1: install odscen\[carla\]"
    ):
        carry_out_in(old, ["cosim"], package="carla")
    with pytest.raises(MissingDependencyError, match="has not both odscen and carla"):
        carry_out_in(bare, ["cosim"], package="carla")
