"""Pages from the templates beside this module.

What a template is given is escaped unless it is :class:`odscen.base.markup.Markup`, and loses
what XML cannot hold; a name that a template does not know is an error. Templates have the macros
of ``kit.html.j2`` as ``kit``, and the filters below.
"""

from __future__ import annotations

import base64
import hashlib
from functools import cache
from importlib.resources import files
from typing import TYPE_CHECKING

from jinja2 import Environment, FunctionLoader, StrictUndefined

from odscen.base.markup import Markup, escaped, number

if TYPE_CHECKING:
    from collections.abc import Sequence

    from jinja2 import Template


def render_page(template: str, **values: object) -> str:
    """Whole page of a template that extends ``page.html.j2``; ``values`` has its ``title``."""
    return _load_template(template).render(values)


def render_block(template: str, block: str, **values: object) -> Markup:
    """One block of a template, such as one section of the report of a run."""
    loaded = _load_template(template)
    return Markup("".join(loaded.blocks[block](loaded.new_context(values))))


def html_page(title: str, body: Markup) -> str:
    """Whole page with our style and script around ``body``; it forbids itself everything else."""
    return render_page("page.html.j2", title=title, body=body)


def page_head(
    kind: str, title: str, *parts: Markup | None, verdict: str = "", style: str = ""
) -> Markup:
    """Head of a page: what kind of page, of what, the verdict in a colour, and what follows.

    Parameters
    ----------
    style
        Class of the verdict: good, fair or bad.
    """
    return _fill_macro("head", kind, title, verdict, style, parts=parts)


def report_section(heading: str, *children: Markup | None, explained: str, ident: str) -> Markup:
    """Section with heading, content, and a sentence on how to read it."""
    return _fill_macro("section", heading, ident, explained, parts=children)


def html_table(
    heads: Sequence[str], rows: Sequence[Markup], *, label: str | None = None, **attributes: str
) -> Markup:
    """Table that scrolls where there is no room; ``rows`` are ``tr``, ``label`` names it."""
    given = {name.rstrip("_"): value for name, value in attributes.items()}
    return _fill_macro("table", heads, label, given, parts=rows)


def _fill_macro(macro: str, *values: object, parts: Sequence[Markup | None]) -> Markup:
    """Call a macro of ``kit.html.j2`` that is written around what it is called with."""
    inner = Markup("\n".join(part for part in parts if part))
    return Markup(
        getattr(_load_template("kit.html.j2").module, macro)(*values, caller=lambda: inner)
    )


def _load_template(name: str) -> Template:
    return _template_environment().get_template(name)


@cache
def _template_environment() -> Environment:
    environment = Environment(
        loader=FunctionLoader(lambda name: _read_text("templates", name)),
        autoescape=True,
        finalize=escaped,
        keep_trailing_newline=True,
        trim_blocks=True,
        lstrip_blocks=True,
        undefined=StrictUndefined,
    )
    environment.filters["number"] = _format_number
    environment.filters["count"] = lambda value: f"{value:,}"
    environment.filters["route"] = lambda movement: str(movement).replace(">", " > ")
    environment.filters["digest"] = _digest_script
    styles = [_read_text("assets", f"{name}.css") for name in ("report", "signals", "replay")]
    environment.globals |= {"page_style": Markup("".join(styles)), "scripts": [PAGE_SCRIPT]}
    # Blocks are also rendered alone, where imports at the top of their template are not seen.
    environment.globals["kit"] = environment.get_template("kit.html.j2").module
    return environment


def _digest_script(script: str) -> str:
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    return Markup(f"sha256-{digest}")


def _format_number(value: float | None, digits: int = 2, missing: str = "-") -> str:
    return missing if value is None else number(float(value), digits)


def _read_text(folder: str, name: str) -> str:
    return (files("odscen.reports") / folder / name).read_text(encoding="utf-8")


PAGE_SCRIPT = Markup(_read_text("assets", "report.js"))
"""Script of every page."""
REPLAY_SCRIPT = Markup(_read_text("assets", "replay.js"))
"""Script of the block ``replay`` of a run's report."""
