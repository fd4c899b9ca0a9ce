"""Deterministic damage to files of any kind: the same content and generator give the same bytes."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from contextlib import suppress
from typing import Any, NamedTuple

import numpy as np

Generator = np.random.Generator
Change = Callable[[bytes, Generator], bytes]

DEEP = 100_000
_MOST_ADDED = 5_000_000
"""Bytes: what is made here is in the memory of each command that is forked."""
LONG_CELL = 131_073
"""One more character than Python's csv module takes in a field unless told otherwise."""
NUMBERS = (
    "0",
    "-1",
    "-0.0",
    "1",
    "0.5",
    "3.999",
    "1e-300",
    "1e18",
    "1e308",
    "-1e308",
    "1e400",
    "NaN",
    "Infinity",
    "-Infinity",
    "9" * 400,
    "1_000",
    "12,5",
    "0x10",
    "",
    "abc",
    "1e6",
    "2147483648",
)
WORDS = (
    "",
    " ",
    "a>b",
    "<b>",
    '"',
    "'",
    "&",
    "..",
    "../../etc",
    "/",
    "\\",
    "a b",
    "a,b",
    "a;b",
    "a:b",
    "\u202eabc",
    "\x1b[31m",
    "\x00",
    "\x07",
    "ä" * 300,
    "x" * 10_000,
    "%s",
    "{0}",
    "${x}",
    "😀",
    "r1>j10>r2",
    "None",
    "nan",
    "-",
    "#",
    "\n",
    "\t",
    "CON",
    "__class__",
    "\ud800",
)
_NUMBER = re.compile(rb"(?<![\w.])-?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?")


class Damage(NamedTuple):
    """What was done, and the result."""

    kind: str
    data: bytes


def pick(rng: Generator, choices: Any) -> Any:
    """One of a sequence."""
    return choices[int(rng.integers(len(choices)))]


def damaged(data: bytes, rng: Generator, changes: dict[str, Change]) -> Damage:
    """One change, sometimes two or three, one upon the other."""
    kinds = []
    for _ in range(int(pick(rng, (1, 1, 1, 2, 3)))):
        kind = pick(rng, sorted(changes))
        kinds.append(kind)
        with suppress(ValueError, LookupError, OverflowError, TypeError):  # nothing to damage
            data = changes[kind](data, rng)
    return Damage(" + ".join(kinds), data)


def torn(data: bytes, rng: Generator) -> bytes:
    """The beginning only."""
    return data[: int(rng.integers(len(data) + 1))]


def flipped(data: bytes, rng: Generator) -> bytes:
    """Some bytes that are others."""
    found = bytearray(data)
    for _ in range(int(rng.integers(1, 20)) if found else 0):
        found[int(rng.integers(len(found)))] = int(rng.integers(256))
    return bytes(found)


def _hole(data: bytes, rng: Generator) -> bytes:
    """Nulls in the middle, as a file has after a power cut."""
    start = int(rng.integers(len(data) + 1))
    return data[:start] + bytes(min(4096, len(data) - start)) + data[start + 4096 :]


def _twice(data: bytes, rng: Generator) -> bytes:
    return data + data[int(rng.integers(len(data) + 1)) :]


def _empty(_data: bytes, rng: Generator) -> bytes:
    return pick(rng, (b"", b"\n", b"\x00", b"{}", b"[]", b"null", b"\xef\xbb\xbf", b"\xff\xfe"))


def _number(data: bytes, rng: Generator) -> bytes:
    found = list(_NUMBER.finditer(data))
    if not found:
        return data
    one = pick(rng, found)
    return data[: one.start()] + pick(rng, NUMBERS).encode() + data[one.end() :]


def _line(data: bytes, rng: Generator) -> bytes:
    lines = data.splitlines(keepends=True)
    if not lines:
        return data
    one, other = int(rng.integers(len(lines))), int(rng.integers(len(lines)))
    what = pick(rng, ("drop", "double", "swap"))
    if what == "drop":
        del lines[one]
    elif what == "double":
        lines.insert(other, lines[one])
    else:
        lines[one], lines[other] = lines[other], lines[one]
    return b"".join(lines)


def _encoding(data: bytes, rng: Generator) -> bytes:
    text = data.decode("utf-8", errors="replace")
    return text.encode(pick(rng, ("utf-16", "utf-32", "utf-8-sig", "cp037")), errors="replace")


def _deep(_data: bytes, rng: Generator) -> bytes:
    return pick(rng, (b"[", b'{"a":', b"<a>", b'[{"a":')) * DEEP


RAW: dict[str, Change] = {
    "bytes": flipped,
    "cut": torn,
    "empty": _empty,
    "hole": _hole,
    "twice": _twice,
}
TEXT: dict[str, Change] = {
    **RAW,
    "deep": _deep,
    "encoding": _encoding,
    "line": _line,
    "number": _number,
}


def _places(value: Any, path: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    found = [path]
    if isinstance(value, dict):
        for key, part in value.items():
            found += _places(part, (*path, key))
    elif isinstance(value, list):
        for index, part in enumerate(value[:200]):
            found += _places(part, (*path, index))
    return found


def _odd(rng: Generator) -> Any:
    return pick(
        rng,
        (
            None,
            True,
            False,
            [],
            {},
            -1,
            0,
            1,
            0.5,
            1e18,
            1e308,
            -1e308,
            2**63,
            2**64,
            10**400,
            float("nan"),
            float("inf"),
            [[]],
            {"a": 1},
            [None],
            *WORDS,
            *NUMBERS,
        ),
    )


def json_value(data: bytes, rng: Generator) -> bytes:
    """Something else in one place of a JSON document, or that place gone, doubled or renamed."""
    try:
        value = json.loads(data)
    except (ValueError, RecursionError):
        return _number(data, rng)
    places = [path for path in _places(value) if path]
    if not places:
        return data
    path = pick(rng, places)
    parent = value
    for step in path[:-1]:
        parent = parent[step]
    what = pick(rng, ("value", "value", "value", "drop", "more", "rename", "copy"))
    if what == "value":
        parent[path[-1]] = _odd(rng)
    elif what == "drop":
        del parent[path[-1]]
    elif what == "copy":
        other = pick(rng, places)
        found = value
        for step in other:
            found = found[step]
        parent[path[-1]] = json.loads(json.dumps(found))
    elif isinstance(parent, list):
        parent[path[-1] : path[-1]] = [parent[path[-1]]] * int(pick(rng, (1, 2, 50)))
    elif what == "rename":
        parent[pick(rng, WORDS)] = parent.pop(path[-1])
    else:
        parent[pick(rng, WORDS)] = _odd(rng)
    return _as_json(value)


def _as_json(value: Any) -> bytes:
    return json.dumps(value, indent=1).encode()


JSON: dict[str, Change] = {**TEXT, **{f"value {n}": json_value for n in range(12)}}


def _cell(data: bytes, rng: Generator) -> bytes:
    rows = [line.split(",") for line in data.decode("utf-8", errors="replace").splitlines()]
    if not rows:
        return data
    row = pick(rng, rows)
    column = int(rng.integers(len(row)))
    row[column] = pick(rng, (*NUMBERS, *WORDS, "x" * LONG_CELL, '"', '"\n', "1,2", "=1+1"))
    return "\n".join(map(",".join, rows)).encode("utf-8", errors="surrogatepass") + b"\n"


def _columns(data: bytes, rng: Generator) -> bytes:
    rows = [line.split(",") for line in data.decode("utf-8", errors="replace").splitlines()]
    width = max(map(len, rows), default=0)
    if not width:
        return data
    one, other = int(rng.integers(width)), int(rng.integers(width))
    for row in rows:
        if one < len(row) and other < len(row):
            row[one], row[other] = row[other], row[one]
    return "\n".join(map(",".join, rows)).encode() + b"\n"


def _semicolons(data: bytes, _rng: Generator) -> bytes:
    return data.replace(b",", b";")


def _many_rows(data: bytes, _rng: Generator) -> bytes:
    lines = data.splitlines(keepends=True)
    more = b"".join(lines[1:2])
    return data + more * min(20_000, _MOST_ADDED // max(len(more), 1))  # one may be long by now


CSV: dict[str, Change] = {
    **TEXT,
    **{f"cell {n}": _cell for n in range(8)},
    "columns": _columns,
    "semicolons": _semicolons,
    "many rows": _many_rows,
}


def _toml_value(data: bytes, rng: Generator) -> bytes:
    lines = data.decode("utf-8", errors="replace").split("\n")
    places = [n for n, line in enumerate(lines) if " = " in line]
    if not places:
        return data
    n = pick(rng, places)
    key = lines[n].split(" = ")[0]
    value = pick(
        rng,
        (
            *NUMBERS,
            "[]",
            "{}",
            "true",
            '""',
            *(repr(word) for word in WORDS),
            '{ kind = "uniform", low = 3, high = 1e308 }',
            '{ kind = "normal", mean = 1e18, std = 0, low = 1e18, high = 1e18 }',
            '{ kind = "choice", values = [] }',
            '{ kind = "choice", values = [1], weights = [0] }',
        ),
    )
    lines[n] = f"{key} = {value}"
    return "\n".join(lines).encode("utf-8", errors="surrogatepass")


TOML: dict[str, Change] = {**TEXT, **{f"entry {n}": _toml_value for n in range(8)}}


def changes_for(name: str) -> dict[str, Change]:
    """What can happen to a file of this name."""
    from bench.fuzz.archive_damage import ARCHIVE
    from bench.fuzz.map_damage import XML

    ends = {".json": JSON, ".csv": CSV, ".npz": ARCHIVE, ".xml": XML, ".xodr": XML, ".toml": TEXT}
    for end, changes in ends.items():
        if name.endswith(end):
            return changes
    return RAW if name.endswith(".parquet") else TEXT
