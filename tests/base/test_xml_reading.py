from __future__ import annotations

from pathlib import Path

import pytest

from odscen.base.errors import InputError
from odscen.base.xml_reading import read_xml


@pytest.mark.parametrize(
    "text",
    ["", "<a>", "<a b=1/>", "<a>" * 100_000, b"<a>\xff</a>", b'<?xml version="1.0" encoding="x"?>'],
)
def test_what_is_not_well_formed_is_refused_in_words_for_people(text: str | bytes) -> None:
    with pytest.raises(InputError, match="not well-formed XML: ") as refused:
        read_xml(text)
    assert "<string>" not in str(refused.value)


def test_an_entity_of_a_file_is_not_read(tmp_path: Path) -> None:
    secret = tmp_path / "secret"
    secret.write_text("secret")
    root = read_xml(f'<!DOCTYPE a [<!ENTITY x SYSTEM "{secret.as_uri()}">]><a>&x;</a>')
    assert "secret" not in "".join(root.itertext())


def test_a_text_is_taken_as_it_is_whatever_its_declaration_says() -> None:
    root = read_xml('<?xml version="1.0" encoding="latin-1"?><a b="ä"/>')
    assert root.get("b") == "ä"


def test_comments_and_blanks_are_left_out_where_asked() -> None:
    text = "<a> <!-- c --> <b/><?p i?></a>"
    assert [one.tag for one in read_xml(text, bare=True)] == ["b"]
    assert len(read_xml(text)) == 3
