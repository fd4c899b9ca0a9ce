"""What a scenario was made of, where it is a variant of another."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import Field, WithJsonSchema

from odscen.scenario.document.document_parts import Label, Part

EditValue = Annotated[
    Any,
    WithJsonSchema({"type": ["null", "boolean", "number", "string", "array", "object"]}),
]
"""An argument of an edit: any JSON, for what is possible is for the edit to say."""

Sha256 = Annotated[str, Field(pattern=r"^[0-9a-f]{64}$")]


class Variant(Part):
    """The scenario that a variant was made of, and the edits that made it.

    ``parent`` is the name of its file, ``parent_sha256`` and ``sha256`` are of the content of the
    parent and of this scenario when it was made, seed and name apart. An edit is an object with its
    ``kind`` and arguments, as :mod:`odscen.scenario.edits` has them.
    """

    parent: Label
    parent_sha256: Sha256
    sha256: Sha256
    edits: Annotated[tuple[dict[str, EditValue], ...], Field(min_length=1, max_length=5000)]
