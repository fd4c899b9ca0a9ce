"""Pages that need nothing but their text; only that behind the printed link runs a script.

Two of the token, the one that asks for it and the one behind the printed link, and the list of what
programs can ask the server for.
"""

from __future__ import annotations

import base64
import hashlib
from html import escape
from typing import TYPE_CHECKING, Any

from starlette.responses import HTMLResponse

if TYPE_CHECKING:
    from collections.abc import Sequence

_STYLE = """
:root { color-scheme: light dark; }
body { font: 16px/1.5 system-ui, sans-serif; margin: 0; min-height: 100vh; display: grid;
  place-items: center; background: light-dark(#f6f7f9, #16181c);
  color: light-dark(#1b1f24, #e8eaed); }
main { max-width: 34rem; margin: 1rem; padding: 1.5rem 2rem 2rem; border-radius: 10px;
  border: 1px solid light-dark(#d5d9df, #3a3f47); background: light-dark(#fff, #1f2227); }
h1 { font-size: 1.35rem; margin: 0 0 .5rem; }
code { font-size: .92em; padding: .1em .35em; border-radius: 4px;
  background: light-dark(#eceff3, #2c3138); overflow-wrap: anywhere; }
label { display: block; font-weight: 600; margin: 1.2rem 0 .3rem; }
form div { display: flex; gap: .5rem; flex-wrap: wrap; }
input, button { font: inherit; padding: .45rem .7rem; border-radius: 6px; }
input { flex: 1 1 14rem; border: 1px solid light-dark(#878e99, #838b96);
  background: light-dark(#fff, #16181c); color: inherit; }
button { border: 0; background: light-dark(#1862ab, #74b7f5); color: light-dark(#fff, #101418);
  font-weight: 600; cursor: pointer; }
.wrong { color: light-dark(#b42318, #ff9b90); font-weight: 600; }
a { color: light-dark(#1862ab, #74b7f5); }
"""
_HEADERS = {
    "Content-Security-Policy": "default-src 'none'; style-src 'unsafe-inline'; form-action 'self'",
    "Cache-Control": "no-store",
}

_LEAD_ON = (
    'const link = document.querySelector("a");'
    "link.hash = location.hash;"
    "location.replace(link.href);"
)
_LEAD_ON_DIGEST = base64.b64encode(hashlib.sha256(_LEAD_ON.encode()).digest()).decode()


def token_needed(*, wrong: bool, query: Sequence[tuple[str, str]] = ()) -> HTMLResponse:
    """Say what to do where the token is missing, or is not the one of now.

    The form leads to where one wanted to go: it has no address of its own, so that a browser keeps
    the path and what is behind the #, and ``query`` is what the address had besides.
    """
    refusal = (
        '<p class="wrong" role="alert">This is not the token of the server as it runs now.</p>'
    )
    given = [(escape(name, quote=True), escape(value, quote=True)) for name, value in query]
    kept = "".join(f'<input type="hidden" name="{key}" value="{text}">' for key, text in given)
    body = f"""<h1>This page needs the token of its server</h1>
{refusal if wrong else ""}
<p>Others may use this computer too, so odscen opens only for those who started it. Do one of
these:</p>
<ul>
<li>Open the link that <code>odscen serve</code> printed in its terminal when it was started. It
ends in <code>/?token=</code> and a long text.</li>
<li>Copy the text after <code>token=</code> from there into this field.</li>
</ul>
<form method="get">{kept}
<label for="token">Token</label>
<div><input id="token" name="token" type="password" autocomplete="off" autofocus required>
<button>Open odscen</button></div>
</form>
<p>Came here by a link of another page? Load this page again.</p>"""
    return HTMLResponse(_html_page("odscen: token needed", body), status_code=401, headers=_HEADERS)


def enter(address: str) -> HTMLResponse:
    """Lead on to an address of this server without the token.

    A page rather than a redirect: the browser sends a SameSite=Strict cookie only if it comes from
    here, and it comes from a terminal, a file or somebody's notes. It takes the place of the link
    in the history. A script keeps what is behind the #; without scripts one comes to the page.
    """
    shown = escape(address, quote=True)
    body = f'<p>Opening <a href="{shown}">odscen</a> ...</p>'
    head = f'<noscript><meta http-equiv="refresh" content="0;url={shown}"></noscript>'
    page = _html_page("odscen", f"{body}<script>{_LEAD_ON}</script>", head)
    policy = f"{_HEADERS['Content-Security-Policy']}; script-src 'sha256-{_LEAD_ON_DIGEST}'"
    return HTMLResponse(page, headers={**_HEADERS, "Content-Security-Policy": policy})


def interface_page(schema: dict[str, Any]) -> HTMLResponse:
    """List what an OpenAPI schema has, by path: what it does, takes and gives."""
    listed = "".join(
        f"<h2><code>{method.upper()} {escape(path)}</code></h2>{_describe_operation(operation)}"
        for path, methods in sorted(schema["paths"].items())
        for method, operation in methods.items()
    )
    body = f"""<h1>Interface of odscen {escape(schema["info"]["version"])}</h1>
<p>The whole schema, with the fields of all messages, for programs that read OpenAPI:
<a href="/api/openapi.json">/api/openapi.json</a>.</p>{listed}"""
    return HTMLResponse(_html_page("odscen: interface", body), headers=_HEADERS)


def _describe_operation(operation: dict[str, Any]) -> str:
    text = operation.get("description") or operation.get("summary", "")
    takes = [
        f"{parameter['name']} ({parameter['in']}{', needed' if parameter.get('required') else ''})"
        for parameter in operation.get("parameters", ())
    ]
    body = operation.get("requestBody", {}).get("content", {})
    takes += [_name_message(kind, content) for kind, content in body.items()]
    gives = [
        " ".join((code, *(_name_message(*each) for each in answer.get("content", {}).items())))
        for code, answer in operation["responses"].items()
        if code != "default"
    ]
    lines = [f"<p>{escape(text.partition(chr(10) * 2)[0])}</p>"]
    lines += [
        f"<p>{name}: {escape('; '.join(values))}</p>"
        for name, values in (("Takes", takes), ("Gives", gives))
        if values
    ]
    return "".join(lines)


def _name_message(kind: str, content: dict[str, Any]) -> str:
    """Name of a message's model, else its media type."""
    reference: str = content.get("schema", {}).get("$ref", "")
    return reference.rpartition("/")[2] or kind


def _html_page(title: str, body: str, head: str = "") -> str:
    return f"""<!doctype html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width">
<title>{title}</title>{head}<style>{_STYLE}</style></head>
<body><main>{body}</main></body></html>
"""
