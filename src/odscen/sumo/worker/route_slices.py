"""The routes file of a long run, cut by departure, so that each slice reads its own part only.

Works on what :mod:`odscen.sumo.realize.routes_file` writes: vTypes first, then vehicles and persons
by departure, each beginning on a line of its own. Nothing is parsed but that line.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from odscen.base.errors import SimulationError

if TYPE_CHECKING:
    from pathlib import Path

_BEGIN = re.compile(rb'\s*<(?:vehicle|person)\s[^>]*?\bdepart="([^"]*)"')
_END = b"</routes>"


class RouteSlices:
    """Reads a routes file from front to back.

    Parameters
    ----------
    routes
        The whole run's routes file.
    """

    def __init__(self, routes: Path) -> None:
        self._routes = routes
        self._head = self._read_head()

    def cut(self, offset: int, until: float, target: Path) -> int:
        """Write those who depart before ``until`` to ``target``; return where the next ones begin.

        Parameters
        ----------
        offset
            What the last cut has returned; 0 for the first.
        until
            Seconds.

        Raises
        ------
        SimulationError
            If the file is not in order of departure.
        """
        last = float("-inf")
        with self._routes.open("rb") as source, target.open("wb") as out:
            out.write(self._head)
            source.seek(max(offset, len(self._head)))
            place = source.tell()
            for line in source:
                begin = _BEGIN.match(line)
                if begin is not None:
                    depart = float(begin[1])
                    if depart < last:
                        raise SimulationError(
                            f"{self._routes.name}: not in order of departure at {depart:g} s"
                        )
                    last = depart
                if line.strip() == _END or (begin is not None and last >= until):
                    break
                out.write(line)
                place += len(line)
            out.write(_END + b"\n")
        return place

    def more(self, offset: int) -> bool:
        """Whether any road user departs after the cut that returned ``offset``."""
        with self._routes.open("rb") as source:
            source.seek(max(offset, len(self._head)))
            return _BEGIN.match(source.readline()) is not None

    def _read_head(self) -> bytes:
        head = b""
        with self._routes.open("rb") as source:
            for line in source:
                if _BEGIN.match(line) or line.strip() == _END:
                    break
                head += line
        return head
