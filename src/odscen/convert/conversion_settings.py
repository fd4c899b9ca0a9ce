"""How an OpenDRIVE map is taken over: one frozen object from the door to the builder."""

from __future__ import annotations

from dataclasses import dataclass

from odscen.errors import InputError

_CLOSEST, _WIDEST = 0.1, 100.0


@dataclass(frozen=True, slots=True, kw_only=True)
class ConversionSettings:
    """How a map is converted.

    Attributes
    ----------
    spacing
        Metres between the nodes of the lane graph, 0.1 to 100.

    Raises
    ------
    InputError
        If a value is not possible.
    """

    spacing: float = 2.0

    def __post_init__(self) -> None:
        if not _CLOSEST <= self.spacing <= _WIDEST:
            msg = f"spacing must lie between {_CLOSEST:g} and {_WIDEST:g} m, not {self.spacing:g}"
            raise InputError(msg)


USUAL = ConversionSettings()
"""A conversion without any wish."""
