"""Pickles of plain values and NumPy arrays, read without unpickling.

The opcodes are those of ``pickletools`` (protocols 0 to 5). What they build is kept on a stack
here: numbers, text, bytes, lists, tuples, dictionaries, sets, and arrays of plain types. Nothing is
imported or called; each name that a pickle asks for is refused, but those by which NumPy writes
arrays, which stand for building one of the bytes that are in the file.
"""

from __future__ import annotations

import math
import pickletools
import re
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from odscen.base.errors import InputError
from odscen.base.shown import shown

if TYPE_CHECKING:
    from collections.abc import Callable

MOST_BYTES: Final = 512 * 2**20
MOST_OPCODES: Final = 20_000_000
_DIMENSIONS: Final = 8
_TYPE: Final = re.compile(r"[<>|=]?[biufUS]\d{1,9}")
"""NumPy's bool, whole numbers, floating point, text and bytes."""
_SCALARS: Final = (str, bytes, int, float, bool, type(None))
_PLAIN: Final = (*_SCALARS, bytearray, list, tuple, dict, set, frozenset)


class _Name(NamedTuple):
    """Something that a pickle may name: a stand-in, never the thing itself."""

    name: str


class _Mark:
    """Where the parts of a list, tuple or dictionary begin on the stack."""


class _TypeOfArray:
    """A NumPy type that is being read."""

    def __init__(self, text: str) -> None:
        self.text = text
        self.order = ""

    def made(self) -> np.dtype[Any]:
        # No other text is given to NumPy, which takes small programs.
        if _TYPE.fullmatch(self.text) is None:
            raise InputError(f"an array is of type {shown(self.text)}; numbers and text are read")
        try:
            return np.dtype(self.order + self.text.lstrip("<>|="))
        except (TypeError, ValueError) as error:
            raise InputError(f"an array is of type {shown(self.text)}") from error


class PickledArray:
    """An array of a pickle; ``values`` are there once the pickle has been read to its end."""

    def __init__(self) -> None:
        self.values: np.ndarray[Any, Any] = np.empty(0)

    def fill(self, shape: object, kind: object, data: object, *, columns_first: bool) -> None:
        """Take shape, type and bytes.

        Raises
        ------
        InputError
            If they are none, or do not go together.
        """
        if not (
            isinstance(shape, tuple)
            and len(shape) <= _DIMENSIONS
            and all(isinstance(n, int) and not isinstance(n, bool) and n >= 0 for n in shape)
        ):
            raise InputError("the shape of an array is no whole numbers")
        if not isinstance(kind, _TypeOfArray):
            raise InputError("an array has no type")
        made, raw = kind.made(), _bytes_of(data)
        if made.itemsize == 0:
            raise InputError(f"an array is of type {made}, which has no size")
        if math.prod(shape) * made.itemsize != len(raw):
            raise InputError(f"an array of shape {shape} and type {made} has {len(raw):,} bytes")
        # Not copied: the same bytes may be there as many arrays.
        flat = np.frombuffer(raw, dtype=made)
        self.values = flat.reshape(shape, order="F" if columns_first else "C")


def _bytes_of(data: object) -> bytes | bytearray:
    if isinstance(data, (bytes, bytearray)):
        return data
    if isinstance(data, str):  # as Python 2 wrote them
        try:
            return data.encode("latin-1")
        except UnicodeEncodeError:
            pass
    raise InputError("the content of an array is no bytes")


_COLLECTIONS: Final = ("bytes", "bytearray", "set", "dict", "list", "int", "long")
_NAMES: Final = frozenset(
    {
        *(
            (module, name)
            for module in ("numpy.core.multiarray", "numpy._core.multiarray")
            for name in ("_reconstruct", "scalar")
        ),
        ("numpy", "ndarray"),
        ("numpy", "dtype"),
        ("numpy.core.numeric", "_frombuffer"),
        ("numpy._core.numeric", "_frombuffer"),
        ("_codecs", "encode"),
        *((module, name) for module in ("builtins", "__builtin__") for name in _COLLECTIONS),
        ("collections", "OrderedDict"),
        ("collections", "defaultdict"),
    }
)
"""What arrays and collections are written with; kept as names, and never imported."""


def read_plain_pickle(data: bytes) -> Any:
    """Value of a pickle; arrays are :class:`PickledArray`.

    Raises
    ------
    InputError
        If it is none, is cut off, has more than so many bytes or opcodes, or asks for anything but
        plain values and arrays; says at which byte.
    """
    if len(data) > MOST_BYTES:
        raise InputError(f"it has {len(data) / 2**20:.0f} MB; pickles are read up to 512 MB")
    machine = _Machine()
    position = 0
    try:
        for number, (opcode, argument, at) in enumerate(pickletools.genops(data)):
            position = int(at or 0)
            if number >= MOST_OPCODES:
                raise InputError(f"it has more than {MOST_OPCODES:,} opcodes")
            if opcode.name == "STOP":
                return machine.finish()
            machine.do(opcode.name, argument)
    except InputError as error:
        raise InputError(error.problem, element=f"byte {position}") from error
    # What is wrong with the bytes is raised by pickletools and numpy in many ways.
    except (ValueError, IndexError, KeyError, TypeError, OverflowError, MemoryError) as error:
        raise InputError(
            f"it is no pickle that can be read: {error!s:.100}", element=f"byte {position}"
        ) from error
    raise InputError("the pickle ends before it is complete", element=f"byte {position}")


class _Machine:
    """The stack and the memo of a pickle."""

    def __init__(self) -> None:
        self._stack: list[Any] = []
        self._memo: dict[int, Any] = {}
        self._copied = 0

    def finish(self) -> Any:
        if len(self._stack) != 1:
            raise InputError(f"the pickle ends with {len(self._stack)} values")
        return _require_plain(self._stack[0])

    def do(self, name: str, argument: Any) -> None:
        if name in _CONSTANTS:
            self._stack.append(_CONSTANTS[name])
        elif name in _ARGUMENTS:
            self._stack.append(argument)
        elif name in _IGNORED:
            return
        else:
            method = _METHODS.get(name)
            if method is None:
                raise InputError(f"its opcode {name} is not that of a plain value")
            method(self, argument)

    # -------------------------------------------------------------- stack and memo

    def _pop_value(self) -> Any:
        if not self._stack:
            raise InputError("a value is missing on the stack")
        return self._stack.pop()

    def _pop_to_mark(self) -> list[Any]:
        for place in range(len(self._stack) - 1, -1, -1):
            if isinstance(self._stack[place], _Mark):
                found = self._stack[place + 1 :]
                del self._stack[place:]
                return found
        raise InputError("a mark is missing on the stack")

    def _require_top(self, kind: type | tuple[type, ...]) -> Any:
        if not self._stack or not isinstance(self._stack[-1], kind):
            raise InputError("what is added to is no collection")
        return self._stack[-1]

    def mark(self, _: Any) -> None:
        self._stack.append(_Mark())

    def drop(self, _: Any) -> None:
        self._pop_value()

    def drop_to_mark(self, _: Any) -> None:
        self._pop_to_mark()

    def double(self, _: Any) -> None:
        self._stack.append(self._require_top(object))

    def put(self, index: Any) -> None:
        self._memo[int(index)] = self._require_top(object)

    def memoize(self, _: Any) -> None:
        self._memo[len(self._memo)] = self._require_top(object)

    def get(self, index: Any) -> None:
        if int(index) not in self._memo:
            raise InputError(f"nothing is remembered as number {index}")
        self._stack.append(self._memo[int(index)])

    # -------------------------------------------------------------- collections

    def empty_list(self, _: Any) -> None:
        self._stack.append([])

    def empty_dict(self, _: Any) -> None:
        self._stack.append({})

    def empty_set(self, _: Any) -> None:
        self._stack.append(set())

    def list_of_mark(self, _: Any) -> None:
        self._stack.append([_require_plain(value) for value in self._pop_to_mark()])

    def tuple_of_mark(self, _: Any) -> None:
        self._stack.append(tuple(self._pop_to_mark()))

    def frozenset_of_mark(self, _: Any) -> None:
        self._stack.append(frozenset(map(_require_key, self._pop_to_mark())))

    def dict_of_mark(self, _: Any) -> None:
        made: dict[Any, Any] = {}
        _set_items(made, self._pop_to_mark())
        self._stack.append(made)

    def tuple_of(self, count: int) -> None:
        values = [self._pop_value() for _ in range(count)]
        self._stack.append(tuple(reversed(values)))

    def append(self, _: Any) -> None:
        value = _require_plain(self._pop_value())
        self._require_top(list).append(value)

    def extend(self, _: Any) -> None:
        values = self._pop_to_mark()
        self._require_top(list).extend(map(_require_plain, values))

    def set_item(self, _: Any) -> None:
        value, key = self._pop_value(), self._pop_value()
        _set_items(self._require_top(dict), [key, value])

    def set_items(self, _: Any) -> None:
        values = self._pop_to_mark()
        _set_items(self._require_top(dict), values)

    def add_items(self, _: Any) -> None:
        values = self._pop_to_mark()
        self._require_top(set).update(map(_require_key, values))

    # -------------------------------------------------------------- names and arrays

    def name(self, argument: Any) -> None:
        module, _, name = str(argument).partition(" ")
        self._stack.append(_known_name(module, name))

    def stack_name(self, _: Any) -> None:
        name, module = self._pop_value(), self._pop_value()
        self._stack.append(_known_name(module, name))

    def make(self, _: Any) -> None:
        arguments, made = self._pop_value(), self._pop_value()
        if not isinstance(made, _Name) or not isinstance(arguments, tuple):
            raise InputError("it calls what is no name of an array or a collection")
        value = _MAKERS[made.name](*arguments)
        if isinstance(value, (bytes, str, set)):
            # The same bytes can be asked for again and again in a few bytes each.
            self._copied += len(value)
            if self._copied > MOST_BYTES:
                raise InputError("it makes more of its bytes than are read of a file")
        self._stack.append(value)

    def build(self, _: Any) -> None:
        state = self._pop_value()
        made = self._require_top(object)
        if isinstance(made, _TypeOfArray) and isinstance(state, tuple) and len(state) >= 3:
            if state[1] not in ("<", ">", "|", "=") or any(part is not None for part in state[2:5]):
                raise InputError("an array is of a type with fields, and not of numbers or text")
            made.order = state[1]
        elif isinstance(made, PickledArray) and isinstance(state, tuple) and len(state) == 5:
            _, shape, kind, columns_first, raw = state
            made.fill(shape, kind, raw, columns_first=bool(columns_first))
        else:
            raise InputError("it gives a state to what is no array")


def _known_name(module: object, name: object) -> _Name:
    if not isinstance(module, str) or not isinstance(name, str):
        raise InputError("it asks for what is no name")
    if (module, name) not in _NAMES:
        raise InputError(
            f"it asks for {shown(module)}, {shown(name)}: read are plain values and NumPy arrays, "
            "and nothing of a pickle is run"
        )
    return _Name(name)


def _require_plain(value: Any) -> Any:
    if not isinstance(value, (*_PLAIN, PickledArray)):
        raise InputError("a name or a type is where a value should be")
    return value


def _require_key(value: Any) -> Any:
    # What is deeper would take long to hash, where parts are there many times.
    flat = isinstance(value, tuple) and all(isinstance(part, _SCALARS) for part in value)
    if not isinstance(value, _SCALARS) and not flat:
        raise InputError("a key is no number or text")
    return value


def _set_items(made: dict[Any, Any], values: list[Any]) -> None:
    if len(values) % 2:
        raise InputError("a key has no value")
    for key, value in zip(values[::2], values[1::2], strict=True):
        made[_require_key(key)] = _require_plain(value)


# ---------------------------------------------------------------------------- what names stand for


def _make_empty_array(*_: object) -> PickledArray:
    return PickledArray()


def _make_type(text: object = None, *_: object) -> _TypeOfArray:
    if isinstance(text, _TypeOfArray):
        return text
    if not isinstance(text, str) or len(text) > 20:
        raise InputError("an array has no type")
    return _TypeOfArray(text)


def _make_array(shape: object, kind: object, raw: object) -> PickledArray:
    made = PickledArray()
    order = kind[0] if isinstance(kind, str) and kind[:1] in ("<", ">", "|", "=") else ""
    given = _make_type(kind)
    given.order = order or given.order
    made.fill(shape, given, raw, columns_first=False)
    return made


def _make_array_of_buffer(raw: object, kind: object, shape: object, order: object) -> PickledArray:
    made = PickledArray()
    made.fill(shape, _make_type(kind), raw, columns_first=order == "F")
    return made


def _make_number(kind: object, raw: object = b"") -> Any:
    made = PickledArray()
    made.fill((), kind, raw, columns_first=False)
    return made.values.item()


def _make_bytes(text: object = "", encoding: object = "latin1") -> bytes:
    if not isinstance(text, str) or encoding not in ("latin1", "latin-1"):
        raise InputError("bytes are written as no text")
    return text.encode("latin-1")


def _make_bytearray(raw: object = b"", encoding: object = "latin-1") -> object:
    del encoding
    return raw if isinstance(raw, (bytes, bytearray)) else _bytes_of(raw)


def _make_set(values: object = ()) -> set[Any]:
    if not isinstance(values, (list, tuple)):
        raise InputError("a set is made of no list")
    return set(map(_require_key, values))


def _make_dict(*_: object) -> dict[Any, Any]:
    return {}


def _refuse_call(*_: object) -> Any:
    raise InputError("it calls a type of Python")


_MAKERS: Final[dict[str, Callable[..., Any]]] = {
    "_reconstruct": _make_empty_array,
    "ndarray": _make_array,
    "dtype": _make_type,
    "_frombuffer": _make_array_of_buffer,
    "scalar": _make_number,
    "encode": _make_bytes,
    "bytes": _make_bytearray,
    "bytearray": _make_bytearray,
    "set": _make_set,
    "dict": _make_dict,
    "OrderedDict": _make_dict,
    "defaultdict": _make_dict,
    "int": _refuse_call,
    "long": _refuse_call,
    "list": _refuse_call,
}
_CONSTANTS: Final[dict[str, Any]] = {"NONE": None, "NEWTRUE": True, "NEWFALSE": False}
_ARGUMENTS: Final = frozenset(
    {
        *("INT", "BININT", "BININT1", "BININT2", "LONG", "LONG1", "LONG4", "FLOAT", "BINFLOAT"),
        *("STRING", "BINSTRING", "SHORT_BINSTRING", "UNICODE", "BINUNICODE", "SHORT_BINUNICODE"),
        *("BINUNICODE8", "BINBYTES", "SHORT_BINBYTES", "BINBYTES8", "BYTEARRAY8"),
    }
)
_IGNORED: Final = frozenset({"PROTO", "FRAME"})
_METHODS: Final[dict[str, Callable[[_Machine, Any], None]]] = {
    "MARK": _Machine.mark,
    "POP": _Machine.drop,
    "POP_MARK": _Machine.drop_to_mark,
    "DUP": _Machine.double,
    **dict.fromkeys(("PUT", "BINPUT", "LONG_BINPUT"), _Machine.put),
    **dict.fromkeys(("GET", "BINGET", "LONG_BINGET"), _Machine.get),
    "MEMOIZE": _Machine.memoize,
    "EMPTY_LIST": _Machine.empty_list,
    "EMPTY_DICT": _Machine.empty_dict,
    "EMPTY_SET": _Machine.empty_set,
    "EMPTY_TUPLE": lambda machine, _: machine.tuple_of(0),
    "TUPLE1": lambda machine, _: machine.tuple_of(1),
    "TUPLE2": lambda machine, _: machine.tuple_of(2),
    "TUPLE3": lambda machine, _: machine.tuple_of(3),
    "LIST": _Machine.list_of_mark,
    "TUPLE": _Machine.tuple_of_mark,
    "DICT": _Machine.dict_of_mark,
    "FROZENSET": _Machine.frozenset_of_mark,
    "APPEND": _Machine.append,
    "APPENDS": _Machine.extend,
    "SETITEM": _Machine.set_item,
    "SETITEMS": _Machine.set_items,
    "ADDITEMS": _Machine.add_items,
    "GLOBAL": _Machine.name,
    "STACK_GLOBAL": _Machine.stack_name,
    "REDUCE": _Machine.make,
    "BUILD": _Machine.build,
}
