"""``python -m odscen.carla.server.probe HOST:PORT``: prints what is there, as JSON.

In a process of its own, for the client may end the one it is in.
"""

from __future__ import annotations

import json
import sys

from odscen.base.errors import CarlaError, CarlaReleaseError, MissingDependencyError
from odscen.carla.server.client import Address, connect

TIMEOUT = 5.0


def main() -> None:
    """Ask the server for its release."""
    address = Address.parse(sys.argv[1], timeout=TIMEOUT)
    try:
        connect(address)
    except CarlaReleaseError as error:
        found = ("wrong_version", f"{error}.")
    except (CarlaError, MissingDependencyError) as error:
        found = ("absent", f"{error}.")
    else:
        found = ("connected", f"A CARLA server is at {address}.")
    sys.stdout.write(json.dumps(found) + "\n")


if __name__ == "__main__":
    main()
