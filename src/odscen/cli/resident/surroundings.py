"""What of a command's surroundings a forked process cannot be given, and must be equal.

Imports are few here: this is read at the start of each command.
"""

from __future__ import annotations

import os
import resource
import sys
from zlib import crc32

from odscen.base.shell_variables import OF_THE_SHELL

BEGINNING = "odscen-resident-"
"""Of the names of sockets."""
_LIMITS = sorted(name for name in dir(resource) if name.startswith("RLIMIT_"))
_RIGHTS = (b"Cap", b"NoNewPrivs", b"Seccomp", b"SigBlk")
"""Beginnings of lines of a process's status that say what it may do, and which signals wait."""
_NAMESPACES = ("cgroup", "ipc", "mnt", "net", "pid", "user", "uts")


def describe_surroundings() -> bytes:
    """All that must be equal, in a form to be compared.

    Raises
    ------
    OSError
        If the system does not say it.
    """
    root = os.stat("/")  # noqa: PTH116 - pathlib is one more import
    mask = os.umask(0o077)
    os.umask(mask)
    with open("/proc/self/cgroup", "rb") as file:  # noqa: PTH123
        groups = file.read()
    with open("/proc/self/status", "rb") as file:  # noqa: PTH123
        rights = [line for line in file if line.startswith(_RIGHTS)]
    parts = (
        sorted(item for item in os.environ.items() if item[0] not in OF_THE_SHELL),
        [os.readlink(f"/proc/self/ns/{name}") for name in _NAMESPACES],  # noqa: PTH115
        (root.st_dev, root.st_ino, groups, rights),
        [resource.getrlimit(getattr(resource, name)) for name in _LIMITS],
        (os.getresuid(), os.getresgid(), sorted(os.getgroups())),
        (mask, os.nice(0), sorted(os.sched_getaffinity(0))),
        (sys.executable, sys.version, tuple(sys.flags), sys.warnoptions, sys._xoptions),
        (sys.path[1:], __file__),
    )
    return repr(parts).encode("utf-8", "surrogateescape")


def address_of(surroundings: bytes) -> str:
    """Name of the socket of the process that stays for these surroundings.

    It is an abstract one, of which no file is left. Two may have the same: all is compared then.
    """
    return f"\0{BEGINNING}{os.getuid()}-{crc32(surroundings):08x}"
