"""Reading XML safely, and numbers and choices out of it with errors that name the place."""

from __future__ import annotations

import math
import re
from typing import TYPE_CHECKING, Final, TypeVar, cast

from lxml import etree

from odscen.base.errors import InputError, LimitError, OpenDriveError
from odscen.base.shown import shown, shown_id
from odscen.base.xml_reading import read_xml

if TYPE_CHECKING:
    from collections.abc import Container, Mapping

Element = etree._Element
T = TypeVar("T")

_BOOLEANS: Final[dict[str | None, bool]] = {
    "true": True,
    "1": True,
    "yes": True,
    "false": False,
    "0": False,
    "no": False,
}

_CONTAINERS = frozenset(
    {"OpenDRIVE", "planView", "elevationProfile", "lateralProfile", "lanes", "left", "center"}
    | {"right", "link", "objects", "outlines", "signals"}
)
_NAMED = frozenset({"road", "lane", "object", "signal", "junction", "connection", "controller"})
_SINGLE = frozenset({"header", "geoReference", "offset", "predecessor", "successor", "speed"})


_WHOLE: Final = re.compile(r"([-+]?\d+)\.0*")
"""Whole numbers as writers of real numbers have them."""

CONTROLS: Final = re.compile(r"[\x00-\x1f\x7f-\x9f\u2028\u2029]")
"""Characters that XML permits in attributes, and that no line of text can show."""


def may_have_controls(text: str | bytes) -> bool:
    """Whether attributes of a file may have :data:`CONTROLS`: only if escaped, or beyond ASCII."""
    if isinstance(text, str):
        return not text.isascii() or "&#" in text
    return not text.isascii() or b"&#" in text or b"\0" in text  # UTF-16 has NUL bytes


def load(text: str | bytes, *, max_bytes: int, max_tags: int) -> Element:
    """Root element without namespaces, comments and processing instructions.

    Entities are refused, the network and external DTDs are never touched.

    Raises
    ------
    OpenDriveError
        For anything that is not well-formed XML of a sensible size.
    LimitError
        If there is not enough memory.
    """
    data = text.encode("utf-8", "surrogatepass") if isinstance(text, str) else text
    if len(data) > max_bytes:
        raise OpenDriveError(f"the file has {len(data)} bytes; the limit is {max_bytes}")
    if data.count(b"<") > max_tags:
        raise OpenDriveError(f"the file has {data.count(b'<')} tags; the limit is {max_tags}")
    try:
        root = read_xml(text, bare=True)
    except LimitError:
        raise
    except InputError as err:
        raise OpenDriveError(err.problem) from err
    dtd = root.getroottree().docinfo.internalDTD
    if dtd is not None and any(dtd.iterentities()):  # type: ignore[attr-defined]  # stubs
        raise OpenDriveError("the file declares XML entities; these are refused")
    if b"xmlns" in data:
        _drop_namespaces(root)
    return root


def _drop_namespaces(root: Element) -> None:
    for element in root.iter(etree.Element):
        if "{" in str(element.tag):
            element.tag = etree.QName(element).localname


def _label_of(element: Element) -> str:
    tag = shown_id(str(element.tag))
    if tag in _NAMED and element.get("id"):
        return f"{tag} {shown_id(str(element.get('id')))}"
    if tag in _SINGLE:
        return tag
    before = element.xpath("count(preceding-sibling::*[name() = $tag])", tag=str(element.tag))
    return f"{tag} {int(cast('float', before))}"


def element_path(element: Element) -> str:
    """Where an element is, for people: ``road 7 > laneSection 0 > lane -1 > width 2``."""
    chain = [element, *element.iterancestors()]
    return " > ".join(_label_of(part) for part in reversed(chain) if part.tag not in _CONTAINERS)


def refusal(element: Element, problem: str) -> OpenDriveError:
    """The error for ``element``; the caller raises it."""
    return OpenDriveError(problem, element=element_path(element) or None)


def required(element: Element, name: str) -> str:
    """Text of an attribute that must be there and not be empty."""
    value = element.get(name)
    if value is None or not value.strip():
        what = "is missing" if value is None else "is empty"
        raise refusal(element, f"attribute {name} {what}")
    return str(value)


def number(element: Element, name: str, *, limit: float = 1e9) -> float:
    """A finite number that must be there, absolute value at most ``limit``."""
    text = element.get(name)
    try:
        value = float(text)  # type: ignore[arg-type]  # None is a TypeError
    except (TypeError, ValueError):
        value = math.nan
    # NaN is not between anything. "1_000" is a number in Python, but not in XML.
    if -limit <= value <= limit and "_" not in cast("str", text):
        return value
    raise _number_error(element, name, limit)


def _number_error(element: Element, name: str, limit: float) -> OpenDriveError:
    """What is wrong with an attribute that :func:`number` refuses."""
    text = required(element, name)
    try:
        value = float(text)
    except ValueError:
        value = None
    if value is None or "_" in text:
        return refusal(element, f"{name}={shown(text)} is not a number")
    if not math.isfinite(value):
        return refusal(element, f"{name}={shown(text)} is not a finite number")
    return refusal(element, f"{name}={shown(text)} is beyond the limit of {limit:g}")


def positive(element: Element, name: str, *, limit: float = 1e9) -> float:
    """A finite number above zero."""
    value = number(element, name, limit=limit)
    if value <= 0.0:
        raise refusal(element, f"{name}={shown(element.get(name))} is not above zero")
    return value


def optional_number(element: Element, name: str) -> float | None:
    """A finite number, or ``None`` if the attribute is missing or empty."""
    value = element.get(name)
    return None if not value or value.isspace() else number(element, name)


def number_or(element: Element, name: str, default: float) -> float:
    """A finite number, or ``default`` if the attribute is missing or empty."""
    value = optional_number(element, name)
    return default if value is None else value


def integer(element: Element, name: str, *, limit: int = 10**9) -> int:
    """A whole number that must be there."""
    text = required(element, name)
    match = _WHOLE.fullmatch(text.strip())
    try:
        value = int(match[1] if match else text.replace("_", "?"))
    except ValueError as err:
        raise refusal(element, f"{name}={shown(text)} is not a whole number") from err
    if abs(value) > limit:
        raise refusal(element, f"{name}={shown(text)} is beyond the limit of {limit}")
    return value


def choice(element: Element, name: str, options: Mapping[str | None, T]) -> T:
    """The meaning of an attribute out of ``options``; the key ``None`` stands for its absence."""
    value = element.get(name)
    try:
        return options[value]
    except KeyError as err:
        known = ", ".join(sorted(option for option in options if option))
        raise refusal(element, f"{name}={shown(value)} is none of {known}") from err


def boolean(element: Element, name: str, *, default: bool = False) -> bool:
    """An XML Schema boolean (also ``yes`` and ``no``, which the standard uses)."""
    return choice(element, name, {**_BOOLEANS, None: default, "": default})


def children(element: Element) -> dict[str, list[Element]]:
    """Child elements by name, in the order of the file."""
    groups: dict[str, list[Element]] = {}
    for child in element:
        groups.setdefault(str(child.tag), []).append(child)
    return groups


def only(groups: Mapping[str, list[Element]], tag: str) -> Element | None:
    """The one child of that name or ``None``; several are refused that say something."""
    found = groups.get(tag)
    if not found:
        return None
    found = [element for element in found if len(element) or element.attrib] or found[:1]
    if len(found) > 1:
        raise refusal(found[1], f"there are {len(found)} <{tag}> elements where one is allowed")
    return found[0]


def unread(groups: Mapping[str, list[Element]], read: Container[str]) -> dict[str, int]:
    """How many children of each name are not in ``read``."""
    return {tag: len(found) for tag, found in groups.items() if tag not in read}
