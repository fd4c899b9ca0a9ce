"""SUMO's own files that run with a scenario: routes and additional files of a project.

They come from :mod:`odscen.formats.sumo_project` and are run as they are; what of them odscen has
as parts of its own is nothing that is said twice.
"""

from __future__ import annotations

import base64
import zlib
from typing import Annotated, Literal, Self

from pydantic import Field, field_validator

from odscen.base.errors import InputError
from odscen.scenario.document.document_parts import Part, Seconds

MOST_TEXT = 512_000_000
"""Bytes of a file, unpacked."""


class SumoFile(Part):
    """A file of SUMO: ``packed`` is its text, compressed (zlib) and in base64.

    ``elements`` says how many of each kind it has, for people.
    """

    name: Annotated[str, Field(pattern=r"^[A-Za-z0-9_][A-Za-z0-9_.+=-]{0,119}$")]
    kind: Literal["routes", "additional"]
    packed: str
    elements: dict[str, int] = Field(default_factory=dict)

    @field_validator("packed")
    @classmethod
    def _is_packed(cls, packed: str) -> str:
        try:
            base64.b64decode(packed, validate=True)
        except ValueError as error:
            raise ValueError(f"this is no base64: {error}") from error
        return packed

    @classmethod
    def of(
        cls, name: str, kind: Literal["routes", "additional"], text: str, elements: dict[str, int]
    ) -> Self:
        """Pack a text."""
        packed = base64.b64encode(zlib.compress(text.encode(), 9)).decode()
        return cls(name=name, kind=kind, packed=packed, elements=elements)

    @property
    def text(self) -> str:
        """The text of the file.

        Raises
        ------
        InputError
            If it is damaged, or too long.
        """
        unpacker = zlib.decompressobj()
        try:
            content = unpacker.decompress(base64.b64decode(self.packed), MOST_TEXT)
            if not unpacker.eof:
                raise InputError(f"SUMO file {self.name} is not complete, or too long")
            return content.decode()
        except (zlib.error, ValueError) as error:
            raise InputError(f"SUMO file {self.name} cannot be unpacked: {error}") from error


class SumoProject(Part):
    """Files and options of a SUMO project.

    ``begin`` is when its simulation begins, seconds; times of the run are those of SUMO, and
    nothing happens before. ``options`` are SUMO's own, beside those that the simulation has;
    without them the run has odscen's.
    """

    begin: Seconds = 0.0
    options: Annotated[dict[str, str], Field(max_length=200)] | None = None
    files: tuple[SumoFile, ...] = ()
