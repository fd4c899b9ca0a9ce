"""Errors as data, so that one process can raise what another has met."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from odscen.base.errors import OdscenError

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping


def error_to_data(error: OdscenError) -> dict[str, Any]:
    """Type, arguments and attributes of an error, as JSON can have them."""
    return {"type": type(error).__name__, "args": list(error.args), "fields": vars(error)}


def error_from_data(data: Mapping[str, Any]) -> OdscenError:
    """The same error again: inverse of :func:`error_to_data`, after JSON too."""
    kind = next(kind for kind in _subclass_tree(OdscenError) if kind.__name__ == data["type"])
    # Not by its constructor, whose parameters are not what it keeps.
    error = kind.__new__(kind, *data["args"])
    for name, value in data["fields"].items():
        setattr(error, name, tuple(value) if isinstance(value, list) else value)
    return error


def _subclass_tree(root: type[OdscenError]) -> Iterator[type[OdscenError]]:
    yield root
    for kind in root.__subclasses__():
        yield from _subclass_tree(kind)
