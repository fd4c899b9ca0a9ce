"""What makes a variant of its parent, for comparisons of their runs."""

from __future__ import annotations

from typing import TYPE_CHECKING

from odscen.base.errors import ScenarioError
from odscen.scenario.document.json_form import content_sha256
from odscen.scenario.edits.edit_messages import read_edit

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping
    from typing import Any

    from odscen.scenario.document.scenario_document import Scenario


def made_by_edits(a: Scenario | None, b: Scenario | None) -> Iterator[str]:
    """Yield the edits that make one side of the other, where one is a variant of the other.

    Says so, too, where one of both is not as it was when the variant was made.
    """
    if a is None or b is None:
        return
    for name, child, other, parent in (("B", b, "A", a), ("A", a, "B", b)):
        variant = child.variant
        if variant is None:
            continue
        known = variant.parent_sha256 == content_sha256(parent)
        if not known and variant.parent != parent.name:
            continue
        yield f"{name} is a variant of {other} ({variant.parent}): " + "; ".join(
            map(_words, variant.edits)
        )
        if not known:
            yield f"{other} is not as it was when the variant was made, so more may differ"
        if variant.sha256 != content_sha256(child):
            yield f"{name} was changed after it was made, so more than these edits differs"


def _words(edit: Mapping[str, Any]) -> str:
    try:
        return read_edit(edit).words
    except ScenarioError:  # an edit of another version
        return f"{edit.get('kind')}"
