"""A badge of a suite's result, as SVG without scripts, fonts or links."""

from __future__ import annotations

from typing import TYPE_CHECKING

from odscen.base.markup import element

if TYPE_CHECKING:
    from odscen.experiments.suite import SuiteResult

_LETTER, _MARGIN, _HEIGHT = 6.6, 12.0, 20
"""Pixels: width of a letter on average, of both margins of a word together, and height."""
_GOOD, _BAD, _LABEL = "#1a7f37", "#b3261e", "#4a4a4a"
"""White letters on each have a contrast of at least 5:1."""


def suite_badge(result: SuiteResult) -> str:
    """Badge with the name of the suite, and how many of its scenarios pass."""
    passed = sum(case.status.passes for case in result.cases)
    total = len(result.cases)
    good = passed == total and result.exit_code == 0
    return badge(result.suite.name, f"{passed} of {total} pass", good=good)


def badge(label: str, words: str, *, good: bool) -> str:
    """Badge of two words."""
    left, right = (round(len(text) * _LETTER + _MARGIN) for text in (label, words))
    color = _GOOD if good else _BAD
    font = {"font_family": "Verdana, DejaVu Sans, sans-serif", "font_size": "11", "fill": "#fff"}

    def told(text: str, begin: int, width: int) -> object:
        # The text is fitted to its box, whatever font there is.
        return element(
            "text", text, x=begin + width / 2, y=14, text_anchor="middle",
            textLength=round(width - _MARGIN), **font,
        )  # fmt: skip

    drawn = element(
        "svg",
        element("title", f"{label}: {words}"),
        element("rect", width=left, height=_HEIGHT, fill=_LABEL),
        element("rect", x=left, width=right, height=_HEIGHT, fill=color),
        told(label, 0, left),
        told(words, left, right),
        xmlns="http://www.w3.org/2000/svg",
        width=left + right,
        height=_HEIGHT,
        role="img",
    )
    return f"{drawn}\n"
