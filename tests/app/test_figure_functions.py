"""Figures that installed packages offer."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from odscen.app.figure_functions import installed_figures
from tests.own_figure import install

if TYPE_CHECKING:
    from pathlib import Path


def test_figures_of_packages_are_offered_with_what_they_say_and_what_is_wrong_with_them(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert installed_figures() == ()
    install(tmp_path, monkeypatch)
    found = {one.name: one for one in installed_figures()}
    assert sorted(found) == ["fails", "gone", "top_speed", "words"], "mean_speed is odscen's"
    assert found["top_speed"].definition == "Highest speed that anybody had, m/s."
    assert not found["top_speed"].error
    assert "has no attribute 'gone'" in found["gone"].error
