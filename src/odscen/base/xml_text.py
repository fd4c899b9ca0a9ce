"""Text as XML takes it, byte for byte as ``xml.sax.saxutils`` writes it.

That module imports a client for the network, which takes longer than ``odscen --help`` may.
"""

from __future__ import annotations

import re
from types import MappingProxyType
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping

_TEXT = str.maketrans({"&": "&amp;", "<": "&lt;", ">": "&gt;"})
_ATTRIBUTE = {**_TEXT, **str.maketrans({"\n": "&#10;", "\r": "&#13;", "\t": "&#9;"})}
_NO_ENTITIES: Mapping[str, str] = MappingProxyType({})
_SPECIAL = re.compile(r"[&<>\n\r\t\"]")


def escape(text: str, entities: Mapping[str, str] = _NO_ENTITIES) -> str:
    """Text between tags; further characters are written as ``entities`` say."""
    text = text.translate(_TEXT)
    for character, entity in entities.items():
        text = text.replace(character, entity)
    return text


def quoteattr(text: str) -> str:
    """Value of an attribute with its quotes."""
    if _SPECIAL.search(text) is None:
        return f'"{text}"'
    text = text.translate(_ATTRIBUTE)
    if '"' not in text:
        return f'"{text}"'
    return f"'{text}'" if "'" not in text else f'"{text.replace(chr(34), "&quot;")}"'
