"""HTML of the pages: skeleton, head, sections and tables, from the templates beside this module.

What a template is given is escaped unless it is :class:`odscen.base.markup.Markup`, and loses
what XML cannot hold; a name that a template does not know is an error.
"""

from __future__ import annotations

import base64
import hashlib
from functools import cache
from importlib.resources import files
from typing import TYPE_CHECKING

from jinja2 import Environment, FunctionLoader, StrictUndefined

from odscen.base.markup import Markup, escaped

if TYPE_CHECKING:
    from collections.abc import Sequence


def html_page(title: str, body: Markup) -> str:
    """Whole page with our style and script around ``body``; it forbids itself everything else."""
    style = _text("assets", "report.css") + _text("assets", "signals.css")
    script = _text("assets", "report.js")
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    return _filled(
        "page", title=title, body=body, digest=digest, style=Markup(style), script=Markup(script)
    )


def page_head(
    kind: str, title: str, *parts: Markup | None, verdict: str = "", style: str = ""
) -> Markup:
    """Head of a page: what kind of page, of what, the verdict in a colour, and what follows.

    Parameters
    ----------
    style
        Class of the verdict: good, fair or bad.
    """
    shown = [part for part in parts if part]
    return _filled("head", kind=kind, title=title, verdict=verdict, style=style, parts=shown)


def report_section(heading: str, *children: Markup | None, explained: str, ident: str) -> Markup:
    """Section with heading, content, and a sentence on how to read it."""
    shown = [child for child in children if child]
    return _filled("section", heading=heading, parts=shown, explained=explained, ident=ident)


def html_table(
    heads: Sequence[str], rows: Sequence[Markup], *, label: str | None = None, **attributes: str
) -> Markup:
    """Table that scrolls where there is no room; ``rows`` are ``tr``, ``label`` names it."""
    given = {name.rstrip("_"): value for name, value in attributes.items()}
    return _filled("table", heads=heads, rows=rows, label=label or heads[0], attributes=given)


def _filled(name: str, **values: object) -> Markup:
    return Markup(_environment().get_template(f"{name}.html.j2").render(values))


@cache
def _environment() -> Environment:
    return Environment(
        loader=FunctionLoader(lambda name: _text("templates", name)),
        autoescape=True,
        finalize=escaped,
        keep_trailing_newline=True,
        trim_blocks=True,
        undefined=StrictUndefined,
    )


def _text(folder: str, name: str) -> str:
    return (files("odscen.reports") / folder / name).read_text(encoding="utf-8")
