from __future__ import annotations

import sys

import pytest

from odscen.base.errors import MissingDependencyError
from odscen.carla.server.client import Address, connect


def test_without_the_package_it_says_how_to_get_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "carla", None)
    with pytest.raises(MissingDependencyError, match=r"pip install 'odscen\[carla\]'"):
        connect(Address(timeout=0.5))
