"""Edits as the page asks for them: several are one step for undo."""

from __future__ import annotations

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

from odscen.scenario.edits.edit_messages import AnyEdit

MOST_EDITS = 5000
"""Edits in one request."""


class EditRequest(BaseModel):
    """Edits of one version: all of them or none, and one step for undo.

    ``label`` says in words what they do together; needed only where there are several.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    version: Annotated[int, Field(ge=0, lt=2**53)]
    edits: Annotated[list[AnyEdit], Field(min_length=1, max_length=MOST_EDITS)]
    label: Annotated[str, Field(min_length=1, max_length=80)] | None = None

    @property
    def words(self) -> str:
        """What undo and redo call this."""
        if self.label is not None:
            return self.label
        first = self.edits[0].label
        more = len(self.edits) - 1
        return f"{first} and {more} more" if more else first
