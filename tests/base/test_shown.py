from __future__ import annotations

import pytest

from odscen.base.shown import printable, shown, shown_id, some_of, visible


@pytest.mark.parametrize("plain", ["1", "-1", "road_7", "a.b/c:d", "x" * 60])
def test_plain_ids_are_shown_as_they_are(plain: str) -> None:
    assert shown_id(plain) == plain


@pytest.mark.parametrize(
    ("odd", "expected"),
    [
        ("a > b", "'a > b'"),
        ("it's", '"it\'s"'),
        ("x: y", "'x:\\x20y'"),
        ("\u202eabc", "'\\u202eabc'"),
        ("a\nb", "'a\\nb'"),
        ("", "''"),
        ("y" * 60 + "z" * 20, repr("y" * 37 + "..." + "z" * 20)),
    ],
)
def test_other_ids_are_quoted_and_what_cannot_be_seen_is_escaped(odd: str, expected: str) -> None:
    assert shown_id(odd) == expected


def test_a_value_that_is_not_there_is_nothing() -> None:
    assert shown(None) == "nothing"


def test_names_of_files_stay_readable_and_can_always_be_printed() -> None:
    assert printable("Straße 7.xodr") == "Straße 7.xodr"
    undecodable = b"bad\xff.xodr".decode("utf-8", "surrogateescape")
    assert printable(undecodable) == "bad\\udcff.xodr"
    assert printable("a\u202eb").encode() == b"a\\u202eb"


def test_messages_keep_their_lines_and_escape_what_cannot_be_seen() -> None:
    assert visible("a: \u202eb\n  - ä \x1b[31m\u200b\udcff 'c'\\") == (
        "a: \\u202eb\n  - ä \\x1b[31m\\u200b\\udcff 'c'\\"
    )


def test_of_many_words_some_are_listed_and_the_others_counted():
    assert some_of(["a", "b"]) == "a and b"
    assert some_of([str(n) for n in range(20_001)], most=2) == "0 and 1 and 19,999 more"


def test_long_ids_that_differ_at_their_ends_are_told_apart() -> None:
    """As netconvert numbers signals, behind the names of all nodes that it joined."""
    cluster = f"cluster_{'1234567890_' * 8}"
    told = [shown_id(f"{cluster}{number}") for number in (7, 8)]
    assert told[0] != told[1]
    assert told[0].startswith("'cluster_1234567890")
    assert all(len(text) <= 62 for text in told)
