"""The command line is the same, however little of it is imported."""

from __future__ import annotations

import subprocess
import sys

import pytest
from typer.testing import CliRunner

from odscen.cli.commands import command_line


@pytest.mark.slow
@pytest.mark.parametrize(
    "given", [["--help"], [], ["run", "--help"], ["maps", "pull", "--help"], ["rnu"]]
)
def test_what_is_made_for_a_call_says_the_same_as_the_whole_command_line(given: list[str]) -> None:
    own = CliRunner().invoke(command_line(given), given)
    whole = CliRunner().invoke(command_line(), given)
    assert own.output == whole.output
    assert own.output
    assert own.exit_code == whole.exit_code


def test_a_call_does_not_import_other_commands() -> None:
    code = (
        "import sys; from odscen.cli.commands import command_line; command_line(['run', 'x']);"
        "print(sorted(m for m in sys.modules if m.startswith('odscen.cli.')))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == str(
        ["odscen.cli.commands", "odscen.cli.console", "odscen.cli.run_commands"]
    )
