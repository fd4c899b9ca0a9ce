"""How an OpenDRIVE map is taken over: one frozen object from the door to the builder."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from odscen.base.errors import InputError

_CLOSEST, _WIDEST = 0.1, 100.0


ConverterName = Literal["odscen", "netconvert", "file"]
"""Who wrote a map's SUMO network; ``file`` is one that was brought in for the map."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ConversionSettings:
    """How a map is converted.

    Attributes
    ----------
    spacing
        Metres between the nodes of the lane graph, 0.1 to 100.
    converter
        Who writes the SUMO network; ``None`` keeps that of a map that is there already, and is
        odscen for a new one.

    Raises
    ------
    InputError
        If a value is not possible.
    """

    spacing: float = 2.0
    converter: ConverterName | None = None

    def __post_init__(self) -> None:
        if not _CLOSEST <= self.spacing <= _WIDEST:
            raise InputError(
                f"spacing must lie between {_CLOSEST:g} and {_WIDEST:g} m, not {self.spacing:g}"
            )


USUAL = ConversionSettings()
"""A conversion without any wish."""
