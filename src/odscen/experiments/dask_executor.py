"""Runs of a study carried out by the workers of a Dask scheduler, on as many machines as it has.

Orders are tasks, of as many runs as take a few seconds, and few more than there are workers are
with the scheduler at a time: a study of a million runs is no load for it. Maps are tasks too, by
the hash of their content, so that each goes to a worker once, and is there again after the worker
that had it has died. Outcomes come back to this process, which alone writes: an order that was
carried out twice counts once.
"""

from __future__ import annotations

import io
import os
import tarfile
import time
import uuid
import zlib
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import TYPE_CHECKING, Any, Final

from odscen.base.atomic_folders import new_folder
from odscen.base.checksums import digest
from odscen.base.errors import ConflictError, InputError, MissingDependencyError, ToolError
from odscen.base.folder_locks import locked
from odscen.experiments.table import outcome_row
from odscen.experiments.work import (
    Outcome,
    carry_out_order,
    member,
    refuse_other_versions,
    unpacked,
    versions,
)
from odscen.maps.store import Workspace

if TYPE_CHECKING:
    from collections.abc import Generator, Iterator, Mapping

    from distributed import Client, Future

    from odscen.experiments.work import Orders, WorkOrder
    from odscen.maps.map_entry import MapEntry


CACHE_VARIABLE: Final = "ODSCEN_CACHE"
_PATIENCE: Final = 120.0
_LEVEL: Final = 6


@dataclass(frozen=True, slots=True)
class MapPack:
    """A map and the assets as one file.

    Attributes
    ----------
    sha256
        Of the files in it, hexadecimal.
    content
        Compressed.
    """

    sha256: str
    content: bytes


def pack_map(workspace: Workspace, entry: MapEntry) -> MapPack:
    """Pack a map with the assets of its workspace; equal files give an equal pack."""
    buffer = io.BytesIO()
    with tarfile.open(fileobj=buffer, mode="w", format=tarfile.PAX_FORMAT) as archive:
        for name, path in _list_map_files(workspace, entry):
            content = path.read_bytes()
            archive.addfile(member(name, len(content)), io.BytesIO(content))
    whole = buffer.getvalue()
    return MapPack(digest(whole), zlib.compress(whole, _LEVEL))


def _list_map_files(workspace: Workspace, entry: MapEntry) -> Iterator[tuple[str, Path]]:
    for root, prefix in ((entry.folder, f"maps/{entry.name}"), (workspace.assets_folder, "assets")):
        for path in sorted(root.rglob("*")) if root.is_dir() else ():
            if path.is_file():
                yield f"{prefix}/{path.relative_to(root).as_posix()}", path


def cache_folder() -> Path:
    """Where packs are unpacked: ``$ODSCEN_CACHE``, else the user's cache folder."""
    given = os.environ.get(CACHE_VARIABLE)
    if given:
        return Path(given)
    from platformdirs import user_cache_path

    return user_cache_path("odscen", appauthor=False)


def unpack_map(pack: MapPack) -> Workspace:
    """The workspace of a pack, unpacked if it is not there yet.

    Raises
    ------
    WorkspaceError
        If it cannot be written.
    """
    folder = cache_folder() / "packs" / pack.sha256
    if not folder.is_dir():
        with locked(folder, what=f"map pack {pack.sha256[:12]}", patience=_PATIENCE):
            if not folder.is_dir():
                with new_folder(folder) as part:
                    unpacked(zlib.decompress(pack.content), part)
    return Workspace(folder)


MOST_DEATHS: Final = 3
"""Times that Dask may give up a run, as its workers died, before the run has failed."""
MOST_RUNS: Final = 200
"""Of an order."""
PATIENCE: Final = 60.0
"""Wall seconds to wait for a scheduler that does not answer any more."""
_SHORTEST, _LONGEST = 2.0, 20.0
"""Wall seconds that an order is to take, on few threads and on many."""
_THREADS = 50.0
"""Threads for each second of that."""
_LISTEN = 0.2
_LOOK = 5.0
"""Wall seconds after which the threads of the workers are counted again."""
_MAP_KEY = "odscen-map-"
_CONNECT = "15s"
_PAUSE = 1.0
"""Wall seconds between two attempts to reach a scheduler that is not there."""
_THERE = ("pending", "finished")
"""States in which what has been sent to the scheduler is with it."""
_LARGE_GRAPH = "1GiB"
"""A map goes with the task that gives it, which Dask warns of from 10 MB on."""


def carry_out_packed(order: WorkOrder, packs: Mapping[str, MapPack]) -> list[Outcome]:
    """Carry out an order on a worker, with packs of the maps by name."""
    return carry_out_order(order, {name: unpack_map(pack) for name, pack in packs.items()})


def carried_pack(pack: MapPack) -> MapPack:
    """Give a pack: the task by which a map reaches the workers."""
    return pack


@dataclass(slots=True)
class DaskExecutor:
    """Carries out orders with Dask.

    Attributes
    ----------
    workspace
        Has the maps.
    scheduler
        Address, or the file that the scheduler has written.
    """

    workspace: Workspace
    scheduler: str | None
    _packs: dict[str, Future] = field(default_factory=dict)
    _again: list[WorkOrder] = field(default_factory=list)
    _deaths: dict[str, int] = field(default_factory=dict)
    _sent: int = 0
    _spent: float = 0.0
    _runs: int = 0
    _threads: int = 1
    _looked: float = 0.0
    _lost: float = 0.0

    def outcomes(self, orders: Orders) -> Iterator[list[Outcome]]:
        """Outcomes of each order, when it has been carried out.

        Raises
        ------
        ConflictError
            If a worker has another odscen or SUMO, or none.
        ToolError
            If the scheduler cannot be reached, or not any more.
        """
        lost: float | None = None
        while True:
            with self._open_client(lost) as client:
                if (yield from self._gather_outcomes(client, orders)):
                    return
            lost = self._lost

    def _open_client(self, lost: float | None) -> Client:
        """A client; a scheduler that was lost may take :data:`PATIENCE` to be back."""
        while True:
            try:
                return _make_client(self.scheduler)
            except ToolError:
                if lost is None:
                    raise
                if time.monotonic() - lost > PATIENCE:
                    raise ToolError(
                        f"the Dask scheduler {self.scheduler} is gone; what has ended is kept: "
                        "odscen study resume runs the rest"
                    ) from None
                time.sleep(_PAUSE)

    def _gather_outcomes(
        self, client: Client, orders: Orders
    ) -> Generator[list[Outcome], None, bool]:
        """Give outcomes as long as the client lives; whether there are no more."""
        _refuse_workers(client)
        ended: SimpleQueue[Future] = SimpleQueue()
        running: dict[Future, WorkOrder] = {}
        while client.status != "closed":
            while client.status == "running" and len(running) < self._free_room(client):
                if (order := self._take_next_order(orders)) is None:
                    if running:
                        break
                    return True
                future = self._submit_order(client, order)
                running[future] = order
                future.add_done_callback(ended.put)
            if client.status == "running":
                self._lost = time.monotonic()
            try:
                future = ended.get(timeout=_LISTEN)
            except Empty:
                continue
            if found := self._take_outcomes(future, running.pop(future)):
                self._count_outcomes(found)
                yield found
        self._packs.clear()
        self._again += running.values()
        return False

    def _take_next_order(self, orders: Orders) -> WorkOrder | None:
        if self._again:
            return self._again.pop()
        if not self._runs:
            return orders.next(1)
        wanted = min(max(self._threads / _THREADS, _SHORTEST), _LONGEST)
        size = int(wanted / max(self._spent / self._runs, 1e-3))
        return orders.next(min(max(size, 1), MOST_RUNS))

    def _free_room(self, client: Client) -> int:
        """Orders that may be with the scheduler at a time: each worker has its next one there."""
        if time.monotonic() - self._looked > _LOOK:
            with suppress(OSError):  # a scheduler that is lost just now
                self._threads = max(sum(client.nthreads().values()), 1)
            self._looked = time.monotonic()
        return 2 * self._threads + 1

    def _submit_order(self, client: Client, order: WorkOrder) -> Future:
        maps = {source.map_name: source for source in order.sources.values()}
        packs = {
            name: self._pack_map(client, name, map_use.map_sha256) for name, map_use in maps.items()
        }
        key = f"odscen-order-{uuid.uuid4().hex}"
        return client.submit(carry_out_packed, order, packs, key=key, pure=False)

    def _pack_map(self, client: Client, name: str, sha256: str) -> Future:
        if name not in self._packs:
            pack = pack_map(self.workspace, self.workspace.map_for(name, sha256))
            self._sent += 1
            key = f"{_MAP_KEY}{pack.sha256}-{self._sent}"
            self._packs[name] = client.submit(carried_pack, pack, key=key, pure=False)
        return self._packs[name]

    def _take_outcomes(self, future: Future, order: WorkOrder) -> list[Outcome]:
        """Outcomes of an order; none if it is carried out again."""
        from concurrent.futures import CancelledError

        from distributed import KilledWorker

        try:
            outcome: list[Outcome] = future.result()
        except KilledWorker as error:
            if not str(error.task).startswith(_MAP_KEY):
                return self._retry_killed(order)
            return self._sent_again(order)
        except CancelledError:  # the scheduler has been started anew, and knows nothing of it
            return self._sent_again(order)
        except (ModuleNotFoundError, AttributeError, ImportError) as error:
            raise ConflictError(f"a worker does not have this odscen: {error}") from error
        return outcome

    def _sent_again(self, order: WorkOrder) -> list[Outcome]:
        """Carry out an order again, with maps that are sent anew where they are lost."""
        kept = {name: pack for name, pack in self._packs.items() if pack.status in _THERE}
        self._packs = kept
        self._again.append(order)
        return []

    def _retry_killed(self, order: WorkOrder) -> list[Outcome]:
        """Carry out again, one by one, runs whose workers died; give up those that go on so."""
        lost = []
        for each in order.runs:
            name = each[0].name
            self._deaths[name] = self._deaths.get(name, 0) + 1
            if len(order.runs) == 1 and self._deaths[name] >= MOST_DEATHS:
                words = "the workers that ran it have died again and again: perhaps of memory"
                lost.append(Outcome(name, outcome_row("failed", words)))
            else:
                self._again.append(replace(order, runs=(each,)))
        return lost

    def _count_outcomes(self, found: list[Outcome]) -> None:
        self._runs += len(found)
        self._spent += sum(float(outcome.row.get("seconds", 0.0)) for outcome in found)


def _make_client(scheduler: str | None) -> Client:
    if scheduler is None:
        raise InputError(
            "--executor dask needs --scheduler: its address, such as tcp://host:8786, or its file"
        )
    try:
        import dask
        from distributed import Client
    except ImportError as error:
        raise MissingDependencyError("Dask is not installed: pip install 'odscen[dask]'") from error
    given: dict[str, Any] = {"address": scheduler}
    if Path(scheduler).is_file():
        given = {"scheduler_file": scheduler}
    dask.config.set({"distributed.admin.large-graph-warning-threshold": _LARGE_GRAPH})
    try:
        return Client(**given, timeout=_CONNECT, set_as_default=False, name="odscen")
    except (OSError, ValueError) as error:
        raise ToolError(f"no Dask scheduler answers at {scheduler}: {error}") from error


def _refuse_workers(client: Client) -> None:
    """Refuse workers that are there with other versions; those that come later refuse orders."""
    try:
        answers = client.run(versions, on_error="return")
    except OSError:  # lost just now
        return
    for address, found in answers.items():
        if isinstance(found, OSError):  # it has died
            continue
        if isinstance(found, BaseException):
            raise ConflictError(f"worker {address} does not have this odscen: {found}")
        refuse_other_versions(versions(), found=found, where=f"worker {address}")
