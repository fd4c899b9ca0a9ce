"""XML from outside as elements: entities unresolved, the network and external DTDs untouched."""

from __future__ import annotations

from typing import TYPE_CHECKING

from odscen.base.errors import InputError, LimitError

if TYPE_CHECKING:
    from lxml import etree


def read_xml(text: str | bytes, *, huge: bool = False, bare: bool = False) -> etree._Element:
    """Root element of a document.

    Parameters
    ----------
    huge
        Whether it may be deeper, and its values longer, than documents of people are.
    bare
        Leave out comments, processing instructions and white space between elements.

    Raises
    ------
    InputError
        If it is not well-formed; in libxml's words, with line and column.
    LimitError
        If there is not enough memory.
    """
    from lxml import etree

    data = text.encode("utf-8", "surrogatepass") if isinstance(text, str) else text
    parser = etree.XMLParser(
        # A str has been decoded already: what its declaration says about the encoding is past.
        encoding="utf-8" if isinstance(text, str) else None,
        resolve_entities=False,
        no_network=True,
        load_dtd=False,
        huge_tree=huge,
        remove_comments=bare,
        remove_pis=bare,
        remove_blank_text=bare,
    )
    try:
        root = etree.fromstring(data, parser)
    except MemoryError as error:
        raise _make_memory_error(len(data)) from error
    except etree.XMLSyntaxError as error:
        if getattr(error, "code", None) == etree.ErrorTypes.ERR_NO_MEMORY:
            raise _make_memory_error(len(data)) from error
        # What lxml's own text adds is "(<string>, line 1)".
        raise InputError(f"not well-formed XML: {error.msg}") from error
    except (ValueError, LookupError) as error:
        raise InputError(f"not well-formed XML: {error}") from error
    if root is None:
        raise InputError("not well-formed XML: no element")
    return root


def _make_memory_error(size: int) -> LimitError:
    return LimitError(
        f"there is not enough memory to read XML of {size} bytes; free some and retry"
    )
