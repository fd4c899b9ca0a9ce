import re
from xml.etree import ElementTree as ET

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from odscen.base.markup import Markup, element, escaped, number, path_data

NAMES = st.text(st.characters(exclude_categories=["Cs"]), max_size=30)


def test_text_is_escaped_and_markup_is_not():
    inner = element("b", "<i>")
    assert element("p", inner, " & ", title='"x"') == (
        '<p title="&#34;x&#34;"><b>&lt;i&gt;</b> &amp; </p>'
    )


def test_adding_plain_text_to_markup_escapes_it():
    assert Markup("<b></b>") + "<" == "<b></b>&lt;"


@given(NAMES, NAMES)
def test_whatever_is_written_comes_back_from_an_xml_parser(text, attribute):
    readable = [c for c in text if c >= " " or c in "\t\n"]
    expected = "".join(c for c in readable if c not in "\ufffe\uffff")
    parsed = ET.fromstring(element("a", text, title=attribute).encode())
    assert (parsed.text or "").replace("\ufffd", "") == expected.replace("\ufffd", "")


def test_lone_surrogates_and_control_characters_do_not_get_through():
    assert escaped("a\x00\x1b\ud800b").encode() == b"a?b"


def test_numbers_are_short_and_never_exponents_or_negative_zero():
    assert [number(v) for v in (1.0, 0.1 + 0.2, -0.001, 1e9, 12.345)] == [
        "1",
        "0.3",
        "0",
        "1000000000",
        "12.35",
    ]


@given(
    arrays(np.int64, st.tuples(st.integers(2, 30), st.just(2)), elements=st.integers(-9999, 9999)),
    st.booleans(),
)
def test_path_data_read_back_gives_the_points(points, closed):
    cut = len(points) // 2 if len(points) >= 4 else 0
    start = np.array([0, cut, len(points)] if cut else [0, len(points)])
    data = path_data(points / 100.0, start, closed=closed)
    assert data.count("z") == (len(start) - 1 if closed else 0)
    lines = []
    for piece in data.split("M")[1:]:
        numbers = [int(n) for n in re.findall(r"-?\d+", piece)]
        lines.append(np.cumsum(np.array(numbers).reshape(-1, 2), axis=0))
    assert np.array_equal(np.concatenate(lines), points)
