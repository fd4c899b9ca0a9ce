"""The only door to CARLA: an optional package, one release, and errors that say what to do.

The client speaks to one release of the server only, connects a single time when it is made, and
raises a plain ``RuntimeError`` for everything. So :func:`connect` first waits for the port, then
compares releases.

``carla`` is an optional package (extra ``carla``), for CPython 3.11 and 3.12; it is imported when
a client connects.
"""

from __future__ import annotations

import socket
import time
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

from odscen.base.errors import CarlaError, CarlaReleaseError, InputError, MissingDependencyError
from odscen.carla.server.releases import release_number

if TYPE_CHECKING:
    from collections.abc import Iterator

DEFAULT_PORT = 2000
_RETRY_SECONDS = 0.2


@dataclass(frozen=True, slots=True)
class Address:
    """Where a server listens, and how long (s) to wait for it and for each of its answers.

    ``origin`` is the server itself where something between it and us listens at this address.
    """

    host: str = "127.0.0.1"
    port: int = DEFAULT_PORT
    timeout: float = 10.0
    origin: Address | None = None

    @classmethod
    def parse(cls, text: str, *, timeout: float = 10.0) -> Address:
        """``HOST:PORT``, ``HOST`` or ``:PORT``.

        Raises
        ------
        InputError
            If it is none of these.
        """
        host, colon, port = text.rpartition(":")
        if not colon:
            host, port = text, str(DEFAULT_PORT)
        if not port.isdecimal() or not 0 < int(port) < 2**16:
            raise InputError(
                f"{text!r} is no address of a CARLA server: write HOST:PORT, as in localhost:2000"
            )
        return cls(host or cls().host, int(port), timeout)

    def __str__(self) -> str:
        return str(self.origin or f"{self.host}:{self.port}")

    def listens(self) -> bool:
        """Whether anybody listens there at this moment."""
        if self.origin is not None:
            return self.origin.listens()
        try:
            socket.create_connection((self.host, self.port), timeout=min(2.0, self.timeout)).close()
        except OSError:
            return False
        return True


class CarlaConnection(NamedTuple):
    """The package ``carla``, a client that a server of the right release has answered, a warning.

    The warning, in words, is empty if the server says the very release of the package.
    """

    carla: Any
    client: Any
    warning: str = ""


def connect(address: Address) -> CarlaConnection:
    """Connect with a server; one that is just starting is waited for.

    Raises
    ------
    MissingDependencyError
        If the package ``carla`` is not installed.
    CarlaError
        If there is no server, or it is another release.
    """
    package = import_carla()
    await_port(address.origin or address)
    with answering(address):
        client = package.Client(address.host, address.port)
        client.set_timeout(address.timeout)
        mine, theirs = client.get_client_version(), client.get_server_version()
    if theirs == mine:
        return CarlaConnection(package, client)
    if release_number(theirs) not in (None, release_number(mine)):
        raise CarlaReleaseError(
            f"the CARLA server at {address} is release {theirs}, the package carla is {mine}: "
            f"start a server of release {mine}"
        )
    warning = (
        f"the CARLA server at {address} calls itself {theirs}, the package carla is {mine}: taken "
        "as built from the sources of that release"
    )
    return CarlaConnection(package, client, warning)


@contextmanager
def answering(address: Address) -> Iterator[None]:
    """Turn the client's ``RuntimeError`` into ours: a time-out is all that it ever notices."""
    try:
        yield
    except RuntimeError as error:
        if "time-out" not in str(error):
            raise CarlaError(f"the CARLA server at {address} refused", output=str(error)) from error
        if not address.listens():
            raise CarlaError(
                f"the CARLA server at {address} is gone: no server listens there any more"
            ) from error
        raise CarlaError(
            f"the CARLA server at {address} has not answered for {address.timeout:g} s: it may "
            "have crashed, hang, be loading a map, or be something else; look at its window or "
            "log, then try again"
        ) from error


def import_carla() -> Any:
    """Import the client package.

    Raises
    ------
    MissingDependencyError
        If it is not installed; says how to get it.
    """
    try:
        import carla
    except ImportError as error:
        raise MissingDependencyError(
            "the package carla is not installed: pip install 'odscen[carla]' on CPython 3.11 or "
            "3.12 (there is none for newer ones), or name a Python that has it: odscen cosim "
            "--carla-python PATH"
        ) from error
    return carla


def await_port(address: Address) -> None:
    """Wait until a server listens: a client that is made too early is dead for ever.

    Raises
    ------
    CarlaError
        If none does within the time that the address allows.
    """
    deadline = time.monotonic() + address.timeout
    while True:
        try:
            socket.create_connection((address.host, address.port), timeout=address.timeout).close()
        except socket.gaierror as error:
            raise CarlaError(
                f"no machine named {address.host!r}: check the host of the CARLA server"
            ) from error
        except OSError as error:
            if time.monotonic() >= deadline:
                raise CarlaError(
                    f"no CARLA server at {address} after {address.timeout:g} s "
                    f"({error.strerror or error}): "
                    "start CARLA there, or name the host and port where it runs"
                ) from error
            time.sleep(_RETRY_SECONDS)
        else:
            return
