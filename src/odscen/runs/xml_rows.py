"""Elements of a long XML file that SUMO has written, one by one."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from lxml import etree


def elements(file: Path, *tags: str) -> Iterator[etree._Element]:
    """Yield elements of these tags in order; each is emptied when the next is asked for.

    Raises
    ------
    lxml.etree.XMLSyntaxError
        If the file does not go on to its end.
    """
    from lxml import etree

    parser = etree.iterparse(
        str(file), tag=tags, resolve_entities=False, no_network=True, load_dtd=False
    )
    for _, element in parser:
        yield element
        element.clear()
        while element.getprevious() is not None:  # a day has many
            del element.getparent()[0]
