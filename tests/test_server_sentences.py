"""Sentences of Python source as templates for translators."""

from __future__ import annotations

import pytest

from tools.sentence_templates import templates_of
from tools.server_sentences import server_sentences


@pytest.mark.parametrize(
    ("source", "templates"),
    [
        ("msg = 'nothing to undo'", ["nothing to undo"]),
        (
            "msg = f'no {what} named {name!r}{hint}'",
            ["no {what} named {name}{hint}"],
        ),
        # What is inserted is called by its last name; two of one name are told apart.
        (
            "yield f'{a.low:g} to {b.low:.1f} m, {len(self._rows):,} rows'",
            ["{low} to {low2} m, {rows} rows"],
        ),
        # A choice of words is a sentence each, one of values is not.
        (
            "msg = f\"there is nothing to {'undo' if step < 0 else 'redo'}\"",
            ["there is nothing to undo", "there is nothing to redo"],
        ),
        ("msg = f'it has {one if few else many} rows'", ["it has {value} rows"]),
        # Texts that are added; numbers that are added are none.
        ("msg = 'the file ' + name + ' is gone'", ["the file {name} is gone"]),
        ("msg = f'slice {n + 1} is damaged'", ["slice {n} is damaged"]),
        # Lines, and what goes on another sentence.
        ("raise E(f'it failed\\n{what} is lost')", ["it failed", "{what} is lost"]),
        ("hint = f'; did you mean {close}?'", ["did you mean {close}?"]),
        ("_FAULT = 'a fault: {}, look at it'", ["a fault: {value}, look at it"]),
        # An apostrophe before a brace would quote it in the catalogue.
        ("_TAG = \"tag '{tag}' is not known\"", ["tag ''{tag}' is not known"]),
        # Names, markup, documentation and descriptions are no sentences.
        ("kind = 'vehicle'", []),
        ("line = f'<edge id={name} from={start}/>'", []),
        ("def f():\n    '''What it does, in words.'''", []),
        ("x = Field(description='how long it is')", []),
    ],
)
def test_a_sentence_in_source_is_a_template(source: str, templates: list[str]) -> None:
    assert [template for _, template in templates_of(source)] == templates


def test_the_same_source_gives_the_same_sentences() -> None:
    made = server_sentences()
    assert made == server_sentences()
    assert '"there is nothing to undo"' in made
    assert '"Input should be greater than {gt}"' in made
