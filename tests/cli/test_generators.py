"""``odscen generate --generator`` with options, on the command line."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests import own_generator
from tests.cli.conftest import odscen


@pytest.mark.slow
def test_options_of_a_generator_are_given_and_refused_by_name(
    workspace: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "site").mkdir()
    own_generator.install(tmp_path / "site", monkeypatch)
    plain = ("generate", "--map", "signal_crossing", "--workspace", workspace, "--out", tmp_path)
    asked = (*plain, "--generator", "spread", "--generator-option")
    made = odscen(*asked, "apart=60", "--generator-option", "category=truck", "--json")
    assert made.code == 0, made.err
    (row,) = made.json["scenarios"]
    assert row["fill"]["kept"] == row["actors"] > 0
    assert Path(row["file"]).read_text().count('"category": "truck"') == row["actors"]
    for setting, said in (
        ("apart=1", "option 'apart' is 1, not within 4..400"),
        ("apart=many", "option 'apart' is 'many', not a whole number"),
        ("size=3", "it has no option 'size'; there are apart, category, moving"),
        ("apart", "write NAME=VALUE"),
    ):
        refused = odscen(*asked, setting)
        assert refused.code == 2
        assert said in " ".join(refused.err.split())
    assert odscen(*plain, "--generator-option", "apart=3").code == 2
