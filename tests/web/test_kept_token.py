"""The token of a workspace stays over starts, and is nobody else's."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

import pytest

from odscen.web.kept_token import kept_token
from odscen.web.security import is_token

if TYPE_CHECKING:
    from pathlib import Path

pytestmark = pytest.mark.skipif(os.name == "nt", reason="rights of files are POSIX's")


@pytest.fixture
def tokens(tmp_path: Path) -> Path:
    return tmp_path / "state" / "tokens"


def test_each_workspace_keeps_a_token_of_its_own(tmp_path: Path, tokens: Path) -> None:
    one, other = tmp_path / "one", tmp_path / "other"
    first = kept_token(one, tokens)
    assert is_token(first)
    assert kept_token(one, tokens) == first
    assert kept_token(other, tokens) != first
    renewed = kept_token(one, tokens, renew=True)
    assert renewed != first
    assert kept_token(one, tokens) == renewed


def test_nobody_else_can_read_it_and_it_is_not_in_the_workspace(
    tmp_path: Path, tokens: Path
) -> None:
    workspace = tmp_path / "workspace"
    workspace.mkdir()
    kept_token(workspace, tokens)
    (file,) = tokens.iterdir()
    assert file.stat().st_mode & 0o777 == 0o600
    assert tokens.stat().st_mode & 0o777 == 0o700
    assert list(workspace.iterdir()) == []


def test_a_file_that_others_may_have_read_is_not_used(tmp_path: Path, tokens: Path) -> None:
    first = kept_token(tmp_path, tokens)
    (file,) = tokens.iterdir()
    file.chmod(0o640)
    second = kept_token(tmp_path, tokens)
    assert second != first
    assert file.stat().st_mode & 0o777 == 0o600


@pytest.mark.parametrize("content", ["", "short", "spaces in a token of mine", "x" * 300])
def test_what_can_be_no_token_is_not_used(tmp_path: Path, tokens: Path, content: str) -> None:
    kept_token(tmp_path, tokens)
    (file,) = tokens.iterdir()
    file.write_text(content)
    assert kept_token(tmp_path, tokens) not in (content, content[:256])


def test_a_link_to_a_file_of_somebody_is_not_followed(tmp_path: Path, tokens: Path) -> None:
    planted = tmp_path / "planted"
    planted.write_text("a-token-that-somebody-knows")
    planted.chmod(0o600)
    kept_token(tmp_path, tokens)
    (file,) = tokens.iterdir()
    file.unlink()
    file.symlink_to(planted)
    token = kept_token(tmp_path, tokens)
    assert token != "a-token-that-somebody-knows"
    assert planted.read_text() == "a-token-that-somebody-knows"
    assert kept_token(tmp_path, tokens) == token


def test_where_nothing_can_be_kept_a_start_has_a_token_all_the_same(tmp_path: Path) -> None:
    file = tmp_path / "file"
    file.write_text("")
    assert is_token(kept_token(tmp_path, file / "tokens"))
