"""The journal of a study: nothing that was written is lost, and nothing counts twice."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from odscen.base.errors import InputError
from odscen.experiments import journal as study_journal
from odscen.experiments.journal import JOURNAL_FILE, StudyJournal, read_rows

if TYPE_CHECKING:
    from pathlib import Path

DONE = {"status": "completed"}


def test_rows_are_there_when_their_process_is_killed(tmp_path: Path) -> None:
    with StudyJournal(tmp_path) as journal:
        assert journal.add("a", {**DONE, "mean_speed": 3.5})
        assert read_rows(tmp_path) == {"a": {**DONE, "mean_speed": 3.5}}  # before it is closed


def test_a_torn_line_is_left_out_and_written_over(tmp_path: Path) -> None:
    with StudyJournal(tmp_path) as journal:
        journal.add("a", DONE)
    with (tmp_path / JOURNAL_FILE).open("ab") as file:
        file.write(b'{"run": "b", "sta')
    assert list(read_rows(tmp_path)) == ["a"]
    with StudyJournal(tmp_path) as journal:
        journal.add("c", DONE)
    assert list(read_rows(tmp_path)) == ["a", "c"]


def test_a_run_counts_once_and_its_first_row_stays(tmp_path: Path) -> None:
    with StudyJournal(tmp_path) as journal:
        assert journal.add("a", DONE)
        assert not journal.add("a", {"status": "failed"})
    assert read_rows(tmp_path) == {"a": DONE}


def test_a_long_journal_is_moved_to_parts(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(study_journal, "PART_ROWS", 3)
    names = [f"r{number}" for number in range(8)]
    for chunk in (names[:5], names[5:]):
        with StudyJournal(tmp_path) as journal:
            for name in chunk:
                journal.add(name, DONE)
    assert list(read_rows(tmp_path)) == names
    parts = sorted((tmp_path / "rows").iterdir())
    assert [path.name for path in parts] == ["part-000001.jsonl", "part-000002.jsonl"]
    # Killed between the part and emptying the journal: the same rows in both.
    (tmp_path / JOURNAL_FILE).write_bytes(parts[1].read_bytes())
    assert sorted(read_rows(tmp_path)) == names[:6]


def test_rows_that_are_forgotten_can_come_again(tmp_path: Path) -> None:
    with StudyJournal(tmp_path) as journal:
        journal.add("a", DONE)
        journal.add("b", {"status": "failed"})
    with StudyJournal(tmp_path) as journal:
        journal.forget(["b"])
        assert read_rows(tmp_path) == {"a": DONE}
        assert journal.add("b", DONE)
    assert read_rows(tmp_path) == {"a": DONE, "b": DONE}


def test_a_file_that_is_no_journal_is_named(tmp_path: Path) -> None:
    (tmp_path / JOURNAL_FILE).write_text("{}\n", encoding="utf-8")
    with pytest.raises(InputError, match=r"journal\.jsonl: line 1 is no row"):
        read_rows(tmp_path)
