"""What all parts of the scenario document share: the base class, and kinds of values."""

from __future__ import annotations

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

PRINTABLE = r"^[^\x00-\x1f\x7f\u0085\u2028\u2029\ufffe\uffff]*$"
_IDENTIFIER = r"^[A-Za-z0-9][A-Za-z0-9_.-]*$"

Label = Annotated[str, Field(min_length=1, max_length=200, pattern=PRINTABLE)]
"""One line of text that JSON and XML can both carry."""
Identifier = Annotated[str, Field(pattern=_IDENTIFIER, max_length=64)]
Seconds = Annotated[float, Field(ge=0, le=1e9, allow_inf_nan=False)]


class Part(BaseModel):
    """Base of all parts of the document: frozen, unknown fields refused."""

    model_config = ConfigDict(
        frozen=True,
        extra="forbid",
        allow_inf_nan=False,
        json_schema_serialization_defaults_required=True,
        defer_build=True,  # the validator of the whole document has those of its parts in it
    )
