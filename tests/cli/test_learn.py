"""``odscen learn`` on the command line."""

from __future__ import annotations

from pathlib import Path

from tests.cli.conftest import odscen


def test_a_folder_without_snapshots_is_named(workspace: Path, tmp_path: Path) -> None:
    found = odscen("learn", "evaluate", "--data", tmp_path, "--workspace", workspace, "--json")
    assert found.code == 2
    assert str(tmp_path) in found.err
    assert "odscen learn data" in found.err
