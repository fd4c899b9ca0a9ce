"""Elements and attributes of the standard, read from its XML schemas.

The schemas come with the package asam-qc-opendrive; the standard itself may not be copied here.
"""

from __future__ import annotations

from pathlib import Path

from lxml import etree

XS = "{http://www.w3.org/2001/XMLSchema}"
VERSIONS = ("1.4", "1.5", "1.6.1", "1.7.0", "1.8.0")


def schema_folder() -> Path | None:
    """Folder of the schemas, one folder per version, or ``None`` when they are not installed.

    They come with ``asam-qc-opendrive``, which ``make test`` installs in an environment of its own.
    """
    own = Path(__file__).parents[2] / "build" / "qc"
    return next(own.glob("lib/python*/site-packages/qc_opendrive/schema"), None)


def schema_rows(folder: Path) -> set[tuple[str, str]]:
    """All (``parent/element``, attribute) of one version; all with ""."""
    types: dict[str, etree._Element] = {}
    root = None
    for path in sorted(folder.glob("*.xsd")):
        schema = etree.parse(path).getroot()
        for child in schema:
            if child.tag in {XS + "complexType", XS + "group", XS + "attributeGroup"}:
                types[child.get("name", "")] = child
            if child.tag == XS + "element" and child.get("name") == "OpenDRIVE":
                root = child
    assert root is not None, folder
    rows: set[tuple[str, str]] = set()
    _walk(root, "", types, rows, set())
    return rows


def _walk(
    element: etree._Element,
    parent: str,
    types: dict[str, etree._Element],
    rows: set[tuple[str, str]],
    seen: set[tuple[str, str]],
) -> None:
    name = element.get("name", "")
    key = f"{parent}/{name}" if parent else name
    kind = element.get("type", "").split(":")[-1]
    if (key, kind) in seen:
        return
    seen.add((key, kind))
    rows.add((key, ""))
    bodies = [element, *_bases(types[kind], types)] if kind in types else [element]
    # An element of a base type may be any of the types derived from it (junctions of 1.8).
    bodies += [body for body in types.values() if kind and _extends(body, kind)]
    for body in bodies:
        for child in _parts(body, types):
            if child.tag == XS + "attribute" and child.get("name"):
                rows.add((key, child.get("name", "")))
            elif child.tag == XS + "element" and child.get("name"):
                _walk(child, name, types, rows, seen)


def _extends(body: etree._Element, base: str) -> bool:
    return any(part.get("base", "").split(":")[-1] == base for part in body.iter(XS + "extension"))


def _bases(body: etree._Element, types: dict[str, etree._Element]) -> list[etree._Element]:
    found = [body]
    for extension in body.iter(XS + "extension"):
        base = extension.get("base", "").split(":")[-1]
        if base in types:
            found += _bases(types[base], types)
    return found


def _parts(body: etree._Element, types: dict[str, etree._Element]) -> list[etree._Element]:
    """Attributes and elements directly in a type, groups resolved."""
    parts: list[etree._Element] = []
    for child in body:
        if child.tag in {XS + "attribute", XS + "element"}:
            parts.append(child)
        elif child.tag in {XS + "group", XS + "attributeGroup"}:
            name = child.get("ref", "").split(":")[-1]
            if name in types:
                parts += _parts(types[name], types)
        elif isinstance(child.tag, str):
            parts += _parts(child, types)
    return parts
