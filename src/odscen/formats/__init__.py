"""Foreign formats: all that scenarios and runs are read from and written to, in one list.

A format of odscen is ``FORMAT`` of a module here whose name ends with ``_format``, one of another
package an entry point. What they are is in :mod:`odscen.formats.base`; what several formats need
of a run is in ``recordings``.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache, wraps
from importlib import import_module
from importlib.metadata import entry_points
from pkgutil import iter_modules
from typing import TYPE_CHECKING, Any

from odscen.base.errors import InputError, NotFoundError, OdscenError
from odscen.formats.base import Format

if TYPE_CHECKING:
    from collections.abc import Callable

GROUP = "odscen.formats"
"""Group of entry points."""


@cache
def list_formats() -> dict[str, Format]:
    """All formats by id, odscen's own first; nothing heavy is imported for them.

    One of an installed package that cannot be imported is in the list, neither read nor written,
    and says why.
    """
    names = sorted(module.name for module in iter_modules(__path__))
    own = [import_module(f"{__name__}.{name}") for name in names if name.endswith("_format")]
    formats: dict[str, Format] = {module.FORMAT.id: module.FORMAT for module in own}
    for point in sorted(entry_points(group=GROUP), key=lambda point: point.name):
        if point.name in formats:
            continue
        try:
            given = point.load()
            why = f"{point.value} is not the Format that it has to be"
        except Exception as error:  # whatever an import may raise
            given, why = None, f"cannot be imported from {point.value}: {error!r}"
        if isinstance(given, Format):
            formats[point.name] = replace(
                given,
                id=point.name,
                read=_name_failures(given.read, point.name),
                write=_name_failures(given.write, point.name),
            )
        else:
            formats[point.name] = Format(id=point.name, title=point.name, label=why, of=())
    return formats


def _name_failures(function: Callable[[Any], Any] | None, name: str) -> Any:
    """Let an error of code from outside be a message that names its format."""
    if function is None:
        return None

    @wraps(function)
    def call(source: Any) -> Any:
        try:
            return function(source)
        except OdscenError:
            raise
        except Exception as error:
            raise InputError(f"the format {name} failed: {error!r}") from error

    return call


def find_format(name: str) -> Format:
    """Format of a name.

    Raises
    ------
    NotFoundError
        If there is none.
    InputError
        If the package that gives it cannot be imported.
    """
    formats = list_formats()
    if name not in formats:
        raise NotFoundError("format", name, list(formats))
    if not formats[name].of:
        raise InputError(f"the format {name}: {formats[name].label}")
    return formats[name]


def format_of_file(file: str) -> Format:
    """Format that a file is read as, by the longest ending that one has.

    Raises
    ------
    InputError
        If none has its ending, or several.
    """
    readable = [form for form in list_formats().values() if form.read is not None]
    endings = {
        form.id: max((len(end) for end in form.suffixes if file.lower().endswith(end)), default=0)
        for form in readable
    }
    longest = max(endings.values())
    fitting = [form for form in readable if endings[form.id] == longest]
    if longest and len(fitting) == 1:
        return fitting[0]
    named = ", ".join(f"{form.id} ({', '.join(form.suffixes)})" for form in fitting)
    raise InputError(
        f"its ending is of several formats; name one of them: {named}"
        if longest
        else f"no format has its ending; name the one that it is of: {named}",
        file=file,
    )
