"""SVG and HTML text, escaped by construction.

Map names, actor ids and messages come from files that are not vetted. Everything that becomes
text goes through :func:`element`, which escapes whatever is not already :class:`Markup`; pages are
put together by templates (:mod:`odscen.reports.page_templates`) by the same rule.
"""

from __future__ import annotations

import itertools
import re
from functools import cache
from typing import TYPE_CHECKING, Any, TypeAlias

import markupsafe
import numpy as np

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from odscen.base.arrays import FloatArray, IntArray

_VOID = frozenset({"meta", "input", "br"})
# What XML 1.0 cannot hold; carriage returns do not survive a parser.
_FORBIDDEN = dict.fromkeys([*(c for c in range(32) if chr(c) not in "\t\n"), 0xFFFE, 0xFFFF])
_UNUSUAL = re.compile("[^\\t\\n -~]|[&<>\"']")
"""What may have to be left out or escaped."""


class Markup(markupsafe.Markup):
    """Text that is markup already; what is put together with it is escaped by :func:`escaped`."""

    __slots__ = ()

    @classmethod
    def escape(cls, s: Any, /) -> Markup:
        """As :func:`escaped`."""
        return escaped(s)


Attribute: TypeAlias = str | float | int | None


def number(value: float, digits: int = 2) -> str:
    """Shortest fixed-point text of ``value`` rounded to ``digits``; never ``-0`` or an exponent."""
    text = f"{value:.{digits}f}"
    if "." in text:
        text = text.rstrip("0").rstrip(".")
    return "0" if text in {"-0", ""} else text


def escaped(content: object) -> Markup:
    """``content`` as text, escaped for elements and attributes, without control characters."""
    return Markup(_escape_content(content))


def _escape_content(content: object) -> str:
    if isinstance(content, markupsafe.Markup):
        return content
    text = str(content)
    if not _UNUSUAL.search(text):  # nearly all that there is
        return text
    text = text.translate(_FORBIDDEN)
    if not text.isascii():
        text = text.encode("utf-8", "replace").decode("utf-8")  # lone surrogates cannot be written
    return markupsafe.escape(text)


@cache
def _attribute_name(key: str) -> str:
    return key.rstrip("_").replace("_", "-")


def element(name: str, /, *children: object, **attributes: Attribute) -> Markup:
    """One element of SVG or HTML.

    Parameters
    ----------
    name
        Name of the element.
    children
        Text (escaped) or :class:`Markup`; ``None`` is left out.
    attributes
        ``_`` in a name becomes ``-``, a trailing one is dropped (``class_``); ``None`` is left out;
        floats are written with two digits.
    """
    opened = [name]
    for key, value in attributes.items():
        if value is None:
            continue
        if isinstance(value, float):
            text = number(value)
        else:
            text = str(value) if isinstance(value, int) else _escape_content(str(value))
        opened.append(f'{_attribute_name(key)}="{text}"')
    head = " ".join(opened)
    if name in _VOID:
        return Markup(f"<{head}>")
    inner = "".join(_escape_content(child) for child in children if child is not None)
    return Markup(f"<{head}>{inner}</{name}>" if inner else f"<{head}></{name}>")


def join(parts: list[Markup]) -> Markup:
    """Parts of markup, one after the other."""
    return Markup("".join(parts))


def path_data(xy: FloatArray, start: IntArray, *, closed: bool = False, unit: float = 0.01) -> str:
    """``d`` of an SVG path through many polylines, in whole units, relative after each start.

    Parameters
    ----------
    xy
        Shape ``(N, 2)``: all points.
    start
        Shape ``(K + 1,)``: polyline ``k`` is ``xy[start[k]:start[k + 1]]``.
    closed
        Whether each polyline is a ring to be closed.
    unit
        Length of one unit in the units of ``xy``; 0.01 writes metres as whole centimetres.
    """
    if len(xy) == 0:
        return ""
    whole = np.rint(xy / unit).astype(np.int64)
    steps = np.empty_like(whole)
    steps[0] = 0
    np.subtract(whole[1:], whole[:-1], out=steps[1:])
    begins = start[:-1][start[1:] > start[:-1]]
    steps[begins] = whole[begins]
    words = list(map(str, steps.ravel().tolist()))
    bounds = (2 * start).tolist()
    end = "z" if closed else ""
    parts = []
    for begin, stop in itertools.pairwise(bounds):
        if stop - begin >= 4:
            parts.append(
                f"M{words[begin]} {words[begin + 1]}l{' '.join(words[begin + 2 : stop])}{end}"
            )
    return "".join(parts).replace(" -", "-")


def markdown_table(heads: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Table of a document in Markdown; cells are written as they are."""
    lines = [heads, ["---"] * len(heads), *rows]
    return "".join(f"| {' | '.join(cells)} |\n" for cells in lines)
