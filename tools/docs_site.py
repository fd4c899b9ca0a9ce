"""Hooks of ``make docs``: pages from outside ``docs/``, the command line, links and pictures.

README.md, CONTRIBUTING.md, CHANGELOG.md and maps/README.md are pages of the site as they stand in
the repository; the page of the command line is what ``odscen --help`` says.
"""

from __future__ import annotations

import posixpath
import re
from pathlib import Path
from typing import TYPE_CHECKING

import typer
from typer.cli import get_docs_for_click

from odscen.cli.commands import command_line

if TYPE_CHECKING:
    from mkdocs.config.defaults import MkDocsConfig
    from mkdocs.structure.files import Files
    from mkdocs.structure.pages import Page

ROOT = Path(__file__).parents[1]
ROOT_PAGES = {
    "README.md": "index.md",
    "CONTRIBUTING.md": "contributing.md",
    "CHANGELOG.md": "changes.md",
    "maps/README.md": "maps.md",
}
"""File of the repository -> page of the site."""
COMMAND_LINE = "command-line.md"

_LINK = re.compile(
    r'\[(?P<text>[^\]]*)\]\((?P<to>[^)\s]+)\)|(?P<attribute>src|srcset)="(?P<file>[^"]+)"'
)
_PICTURE = re.compile(
    r'<picture>\s*<source[^>]*srcset="(?P<dark>[^"]+)">\s*'
    r'<img src="(?P<light>[^"]+)"(?P<more>[^>]*)>\s*</picture>'
)


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the pages that are not files below ``docs/``."""
    from mkdocs.structure.files import File  # tests read pages on machines without it

    for source, uri in ROOT_PAGES.items():
        text = (ROOT / source).read_text(encoding="utf-8")
        files.append(File.generated(config, uri, content=text))
    files.append(File.generated(config, COMMAND_LINE, content=_command_line()))
    return files


def on_page_markdown(markdown: str, page: Page, **_: object) -> str:
    """Lead links of the repository to the pages of the site, and pictures to its switch."""
    return switched_pictures(site_links(markdown, page.file.src_uri))


def site_links(markdown: str, page: str) -> str:
    """The text of a page with its relative links led to pages of the site.

    Parameters
    ----------
    markdown
        Text as it stands in the repository; links are relative to its file there.
    page
        Path of the page below the root of the site.

    Returns
    -------
    str
        Links to files that are no part of the site (``LICENSE``, sources) are left as plain text.
    """
    sources = {uri: source for source, uri in ROOT_PAGES.items()}
    folder = posixpath.dirname(sources.get(page, f"docs/{page}"))

    def led(link: re.Match[str]) -> str:
        target, mark, anchor = (link["to"] or link["file"]).partition("#")
        if not target or re.match(r"[a-z]+:", target):
            return link[0]
        place = _place_on_site(posixpath.normpath(posixpath.join(folder, target)))
        if place is None:
            return link["text"] if link["file"] is None else link[0]
        to = posixpath.relpath(place, posixpath.dirname(page) or ".") + mark + anchor
        return f"[{link['text']}]({to})" if link["file"] is None else f'{link["attribute"]}="{to}"'

    return _LINK.sub(led, markdown)


def switched_pictures(markdown: str) -> str:
    """The text of a page with both forms of each picture, one of which the site shows.

    In the repository a picture follows the system (``prefers-color-scheme``). On the site it
    follows the switch at the top, which the theme does for images marked so.
    """
    both = (
        r'<span class="picture"><img src="\g<light>#only-light" loading="lazy"\g<more>>'
        r'<img src="\g<dark>#only-dark" loading="lazy"\g<more>></span>'
    )
    return _PICTURE.sub(both, markdown)


def _place_on_site(source: str) -> str | None:
    for known in (source, posixpath.join(source, "README.md")):
        if known in ROOT_PAGES:
            return ROOT_PAGES[known]
    return source.removeprefix("docs/") if source.startswith("docs/") else None


def _command_line() -> str:
    command = typer.main.get_command(command_line())
    context = typer.Context(command, info_name="odscen")
    text = get_docs_for_click(obj=command, ctx=context, name="odscen", title="The command line")
    # Lists of commands cut their help short; a page has room for its first sentence.
    for group in (command, *command.commands.values()):
        for name, inner in getattr(group, "commands", {}).items():
            short, whole = inner.get_short_help_str(), inner.get_short_help_str(limit=1000)
            text = text.replace(f"* `{name}`: {short}\n", f"* `{name}`: {whole}\n")
    return text
