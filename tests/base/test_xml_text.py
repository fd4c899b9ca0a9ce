"""Text is written as ``xml.sax.saxutils`` writes it, without its imports."""

from __future__ import annotations

import subprocess
import sys
from xml.sax import saxutils

from hypothesis import given
from hypothesis import strategies as st

from odscen.base.xml_text import escape, quoteattr

TEXTS = st.text(st.sampled_from("a&<>\"'\n\r\t ;#ä"), max_size=8)


@given(TEXTS)
def test_text_and_attributes_are_those_of_the_standard_library(text: str) -> None:
    assert escape(text) == saxutils.escape(text)
    assert quoteattr(text) == saxutils.quoteattr(text)


def test_the_command_line_starts_without_tables_and_without_a_client_for_the_network() -> None:
    code = (
        "import sys, odscen.cli, odscen.app.running.runs;"
        "names = 'polars', 'shapely', 'urllib.request', 'ssl';"
        "print([name for name in names if name in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
