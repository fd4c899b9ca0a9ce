"""Ids and other texts of files as messages show them."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence

_PLAIN = re.compile(r"[\w+*#@./:-]+(?:,[\w+*#@./:-]+)*", re.ASCII)
_LONGEST = 60


def shown(value: str | None) -> str:
    """A value as it appears in messages: quoted, never long, and harmless.

    Control characters, and those that turn the direction of writing, are escaped.
    """
    if value is None:
        return "nothing"
    return repr(value if len(value) <= _LONGEST else value[: _LONGEST - 3] + "...")


def some_of(words: Sequence[str], *, most: int = 8, between: str = " and ") -> str:
    """Some words as messages list them, with how many more there are."""
    if len(words) <= most:
        return between.join(words)
    return f"{between.join(words[:most])} and {len(words) - most:,} more"


def printable(text: str) -> str:
    """Text, such as the name of a file, with what cannot be printed escaped.

    That are control characters, those that turn the direction of writing, and what stands in a name
    for bytes that are no UTF-8.
    """
    return text if text.isprintable() else repr(text)[1:-1]


def visible(text: str) -> str:
    """Text of several lines in which what cannot be seen is escaped, and nothing else."""
    if text.isprintable():
        return text
    return "".join(c if c.isprintable() or c in "\n\t" else repr(c)[1:-1] for c in text)


def shown_id(value: str) -> str:
    """An id in the path of an element: as it is where it is plain, else as :func:`shown`.

    Plain are letters and digits of ASCII and what ids are mostly joined with, but nothing that a
    path itself has: spaces, ``>``, quotes. Of a long one both ends stay: tools number the signals
    of a junction behind its name.
    """
    if len(value) <= _LONGEST and _PLAIN.fullmatch(value):
        return value
    if len(value) > _LONGEST:
        value = f"{value[: _LONGEST - 23]}...{value[-20:]}"
    return shown(value).replace(": ", ":\\x20")  # a colon and a space end a path
