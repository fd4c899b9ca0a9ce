"""The two pages of the token: the one that asks for it, and the one behind the printed link.

They need nothing from the server, and run no script.
"""

from __future__ import annotations

from html import escape

from starlette.responses import HTMLResponse

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


def token_needed(*, wrong: bool) -> HTMLResponse:
    """Say what to do where the token is missing, or is not the one of now."""
    told = '<p class="wrong" role="alert">This is not the token of the server as it runs now.</p>'
    body = f"""<h1>This page needs the token of its server</h1>
{told if wrong else ""}
<p>Others may use this computer too, so odscen opens only for those who started it. Do one of
these:</p>
<ul>
<li>Open the link that <code>odscen serve</code> printed in its terminal when it was started. It
ends in <code>/?token=</code> and a long text. Each start has a token of its own.</li>
<li>Copy the text after <code>token=</code> from there into this field.</li>
</ul>
<form method="get" action="/">
<label for="token">Token</label>
<div><input id="token" name="token" type="password" autocomplete="off" autofocus required>
<button>Open odscen</button></div>
</form>
<p>Came here by a link of another page? <a href="/">Load this page again.</a></p>"""
    return HTMLResponse(_html_page("odscen: token needed", body), status_code=401, headers=_HEADERS)


def enter(address: str) -> HTMLResponse:
    """Lead on to an address of this server without the token.

    A page rather than a redirect: the browser sends a SameSite=Strict cookie only if it comes from
    here, and it comes from a terminal, a file or somebody's notes. It takes the place of the link
    in the history.
    """
    shown = escape(address, quote=True)
    body = f'<p>Opening <a href="{shown}">odscen</a> ...</p>'
    head = f'<meta http-equiv="refresh" content="0;url={shown}">'
    return HTMLResponse(_html_page("odscen", body, head), headers=_HEADERS)


def _html_page(title: str, body: str, head: str = "") -> str:
    return f"""<!doctype html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width">
<title>{title}</title>{head}<style>{_STYLE}</style></head>
<body><main>{body}</main></body></html>
"""
