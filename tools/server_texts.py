"""The texts of the closed lists of the server, for the catalogue: figures, templates, models.

The page looks a text up as the server sends it; what is not here is shown in English.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from odscen.app.generators import installed_generators
from odscen.reports.signal_sheet import legend_shapes
from odscen.scenario.templates.template_registry import TEMPLATES
from odscen.sumo.worker.behaviour.behaviour_doors import installed_behaviours
from odscen.web.routes.figure_routes import actor_measures, figures

TARGET = Path(__file__).parents[1] / "frontend/src/language/serverTexts.ts"

_HEAD = """\
// Written by `make api` from the registries of the server.
import type { MessageDescriptor } from "@lingui/core";
import { msg } from "@lingui/core/macro";

/** Texts that the server sends, as it sends them. */
export const SERVER_TEXTS: Readonly<Record<string, MessageDescriptor>> = {
"""


def server_texts() -> str:
    """The module of the page; the same registries give the same text."""
    lines = [f'  "{text}": msg`{text}`,\n' for text in sorted(set(_texts()))]
    return f"{_HEAD}{''.join(lines)}}};\n"


def _texts() -> Iterator[str]:
    for text in _registered():
        # They would end the literal, or be taken for a placeholder.
        assert not set(text) & set('"`\\{}$'), text
        yield text


def _registered() -> Iterator[str]:
    for figure in figures():
        yield figure.label
        if figure.on_page:
            yield figure.definition
    for measure in actor_measures():
        yield measure.label
    for template in TEMPLATES.values():
        yield from (template.title, template.summary, template.needs)
        for number in template.parameters:
            yield from (number.title, number.meaning)
    for _, words in legend_shapes(()):
        yield words
    for one in (*installed_generators(), *installed_behaviours()):
        yield one.summary
        for option in one.options:
            yield option.title
            if option.meaning:
                yield option.meaning
