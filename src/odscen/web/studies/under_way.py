"""Work with many runs that a page has started: one at a time, in a thread that can be stopped."""

from __future__ import annotations

import threading
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from odscen.base.errors import ConflictError, OdscenError

if TYPE_CHECKING:
    from collections.abc import Callable

_END = 10.0
"""Wall seconds that work has for its end when the server ends."""


class StoppedWork(Exception):  # noqa: N818 - no error, and never seen outside
    """The work was stopped."""


@dataclass(slots=True)
class UnderWay:
    """Work of this server.

    Attributes
    ----------
    ended, before
        Runs that have ended, and how many had when it was started or resumed.
    over
        Whether it has ended; ``error`` is why, if it was not to its end.
    """

    began: float
    before: int = 0
    ended: int = 0
    over: bool = False
    error: str | None = None
    stop: threading.Event = field(default_factory=threading.Event)

    def check(self) -> None:
        """Raise if it is to stop."""
        if self.stop.is_set():
            raise StoppedWork

    def seconds_left(self, runs: int) -> float | None:
        """Wall seconds of what is missing, from what the runs so far have taken."""
        new = self.ended - self.before
        spent = time.monotonic() - self.began
        return None if new < 1 else spent / new * (runs - self.ended)


class OneAtATime:
    """Work by name, of which one is under way at most.

    Parameters
    ----------
    what
        What it is, for messages.
    """

    def __init__(self, what: str) -> None:
        self.lock = threading.Lock()
        self._what = what
        self._pool = ThreadPoolExecutor(max_workers=1, thread_name_prefix=what)
        self._known: dict[str, UnderWay] = {}

    def refuse_more(self) -> None:
        """Raise :class:`ConflictError` if something is under way; ``lock`` is to be held."""
        for name, work in self._known.items():
            if not work.over:
                raise ConflictError(
                    f"{self._what} {name!r} is under way; stop it, or wait for its end"
                )

    def start(self, name: str, before: int, work: Callable[[UnderWay], None]) -> None:
        """Start work of which so many runs had ended; it calls ``check`` now and then."""
        known = self._known[name] = UnderWay(time.monotonic(), before, before)
        self._pool.submit(_carry_out_work, known, work)

    def known(self, name: str) -> UnderWay | None:
        """What this server has started by that name, over or not."""
        return self._known.get(name)

    def live(self, name: str) -> UnderWay | None:
        """What is under way by that name."""
        known = self._known.get(name)
        return known if known is not None and not known.over else None

    def stop(self, name: str) -> None:
        """Stop it; :class:`ConflictError` if it is not under way."""
        if (live := self.live(name)) is None:
            raise ConflictError(f"{self._what} {name!r} is not under way")
        live.stop.set()

    def forget(self, name: str) -> None:
        """Forget what is over; :class:`ConflictError` if it is not. ``lock`` is to be held."""
        if self.live(name) is not None:
            raise ConflictError(f"{self._what} {name!r} is under way; stop it first")
        self._known.pop(name, None)

    def close(self) -> None:
        """Stop what is under way; it can be resumed."""
        for work in self._known.values():
            work.stop.set()
        self._pool.shutdown(wait=False, cancel_futures=True)
        end = time.monotonic() + _END
        while time.monotonic() < end and not all(work.over for work in self._known.values()):
            time.sleep(0.02)


def _carry_out_work(known: UnderWay, work: Callable[[UnderWay], None]) -> None:
    try:
        work(known)
    except StoppedWork:
        pass
    except OdscenError as error:
        known.error = str(error)
    except BaseException as error:
        known.error = f"{type(error).__name__}: {error}"
        raise
    finally:
        known.over = True
