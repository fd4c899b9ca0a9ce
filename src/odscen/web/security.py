"""Who may ask: Host, Origin, token, and how much may be sent. One pure ASGI middleware.

A page on the internet can make a browser send requests to a loopback address; its Origin gives it
away, and where a browser sends none (a rebound DNS name), the Host does.
"""

from __future__ import annotations

import asyncio
import hmac
import re
import time
from http.cookies import CookieError, SimpleCookie
from typing import TYPE_CHECKING
from urllib.parse import parse_qs, parse_qsl, urlencode, urlsplit

from fastapi import HTTPException
from starlette.datastructures import Headers
from starlette.responses import RedirectResponse

from odscen.base.errors import InputError
from odscen.web.entry_pages import enter, token_needed
from odscen.web.error_answers import error_response

if TYPE_CHECKING:
    from collections.abc import Collection

    from starlette.types import ASGIApp, Message, Receive, Scope, Send

LOOPBACK = frozenset({"localhost", "127.0.0.1", "::1"})
COOKIE = "odscen_token"
MAX_UPLOAD = 64 * 2**20
"""Bytes of a request with a file in it; the largest CARLA town has 3.4 million."""
MAX_RECORDING = 8 * 2**30
"""Bytes of a request with recorded traffic, which goes to the disk as it comes."""
RECORDINGS = "/api/recordings"
MAX_BODY = 4 * 2**20
"""Bytes of any other request."""
PATIENCE = 30.0
"""Wall seconds for the next part of a request's body."""
MAX_UPLOAD_TIME = 900.0
"""Wall seconds for all of it."""

_HEADERS = (
    (b"x-content-type-options", b"nosniff"),
    (b"referrer-policy", b"no-referrer"),
    (b"cross-origin-resource-policy", b"same-origin"),
    (b"x-frame-options", b"SAMEORIGIN"),
)
_PORT = re.compile(r":\d*$")
_TOKEN = re.compile(r"[A-Za-z0-9_-]{16,256}")


class Guard:
    """Lets through what may come in.

    Parameters
    ----------
    hosts
        Host names that the server answers to; ``None`` for all, which needs a token.
    token
        What a client has to show, as bearer, cookie, or once in the address; ``None`` for nothing.
    """

    def __init__(
        self,
        app: ASGIApp,
        *,
        hosts: Collection[str] | None,
        token: str | None,
        max_upload: int = MAX_UPLOAD,
        max_recording: int = MAX_RECORDING,
    ) -> None:
        self._app = app
        self._hosts = hosts
        self._token = token
        self._max_upload = max_upload
        self._max_recording = max_recording

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer or refuse one request."""
        if scope["type"] == "lifespan":
            await self._app(scope, receive, send)
            return
        headers, send = Headers(scope=scope), _with_headers(scope, send)
        refused = self._foreign_origin(headers)
        if refused is not None:
            await _refuse_request(403, "ForeignRequest", refused, scope, receive, send)
        elif self._token is not None and not self._has_token(headers, scope):
            await _ask_for_token(headers, scope, receive, send)
        elif self._token is not None and (clean := _without_token(scope)) is not None:
            # What is led on by a redirect keeps its place behind the #, but a browser that comes
            # from elsewhere would not send the cookie then.
            here = headers.get("sec-fetch-site") == "same-origin"
            leads = _is_page(headers) and not here
            response = enter(clean) if leads else RedirectResponse(clean, 303)
            name = _cookie_name(scope)
            response.set_cookie(name, self._token, httponly=True, samesite="strict", path="/")
            await response(scope, receive, send)
        elif scope["type"] == "websocket":
            await self._app(scope, receive, send)
        else:
            await self._limit_body(headers, scope, receive, send)

    def _foreign_origin(self, headers: Headers) -> str | None:
        host = headers.get("host", "")
        name = _PORT.sub("", host).strip("[]").lower()
        if self._hosts is not None and name not in self._hosts:
            return f"this server does not answer to the name {name!r}"
        origin = headers.get("origin")
        if origin is not None and _netloc_of_origin(origin) != host.lower():
            return f"a page of {origin!r} may not use this server"
        return None

    def _has_token(self, headers: Headers, scope: Scope) -> bool:
        shown = [headers.get("authorization", "").removeprefix("Bearer ")]
        shown += parse_qs(scope["query_string"].decode("latin-1")).get("token", [])
        try:
            cookie = SimpleCookie(headers.get("cookie", "")).get(_cookie_name(scope))
        except CookieError:
            cookie = None
        if cookie is not None:
            shown.append(cookie.value)
        token = (self._token or "").encode()
        return any(
            hmac.compare_digest(shown_token.encode("utf-8", "replace"), token)
            for shown_token in shown
        )

    async def _limit_body(
        self, headers: Headers, scope: Scope, receive: Receive, send: Send
    ) -> None:
        multipart = headers.get("content-type", "").startswith("multipart/form-data")
        limit = self._max_upload if multipart else min(MAX_BODY, self._max_upload)
        if multipart and scope["path"] == RECORDINGS:
            limit = self._max_recording
        words = f"more than {limit:,} bytes cannot be taken"
        length = headers.get("content-length", "")
        if length.isdigit() and int(length) > limit:
            await _refuse_request(413, "TooLarge", words, scope, receive, send)
            return
        taken, end, whole = 0, time.monotonic() + MAX_UPLOAD_TIME, False

        async def counted() -> Message:
            nonlocal taken, whole
            if whole:  # what is waited for now is the client's leaving
                return await receive()
            left = min(PATIENCE, end - time.monotonic())
            try:
                message = await asyncio.wait_for(receive(), left)
            except TimeoutError as error:
                raise HTTPException(408, "the rest of the request did not come in time") from error
            whole = not message.get("more_body", False)
            taken += len(message.get("body", b""))
            if taken > limit:
                raise HTTPException(413, words)
            return message

        await self._app(scope, counted, send)


def is_token(text: str) -> bool:
    """Whether a text can be a token."""
    return _TOKEN.fullmatch(text) is not None


def check_token(token: str) -> str:
    """Return a token of the user's own if it can be one.

    Raises
    ------
    InputError
        If it is short, or has characters that an address or a cookie cannot have as they are.
    """
    if not is_token(token):
        raise InputError("the token must have 16 to 256 letters, digits, '-' or '_'")
    return token


def _with_headers(scope: Scope, send: Send) -> Send:
    if scope["type"] == "websocket":
        return send

    async def headed(message: Message) -> None:
        if message["type"] == "http.response.start":
            message["headers"] = [*message["headers"], *_HEADERS]
        await send(message)

    return headed


def _cookie_name(scope: Scope) -> str:
    """Cookies belong to a host, whatever its port: servers beside each other need names."""
    port = (scope.get("server") or (None, None))[1]
    return f"{COOKIE}_{port}" if port else COOKIE


def _is_page(headers: Headers) -> bool:
    """Whether a browser asks for something to show."""
    return "text/html" in headers.get("accept", "")


async def _ask_for_token(headers: Headers, scope: Scope, receive: Receive, send: Send) -> None:
    if scope["type"] == "http" and scope["method"] in ("GET", "HEAD") and _is_page(headers):
        query = parse_qsl(scope["query_string"].decode("latin-1"), keep_blank_values=True)
        kept = [(name, value) for name, value in query if name != "token"]
        wrong = len(kept) < len(query)
        await token_needed(wrong=wrong, query=kept)(scope, receive, send)
        return
    message = (
        "this server needs the token that it printed when it was started: open that link again, "
        "or send it as Authorization: Bearer TOKEN"
    )
    await _refuse_request(401, "TokenNeeded", message, scope, receive, send)


def _netloc_of_origin(origin: str) -> str | None:
    """Host and port of an origin; ``None`` if it is none."""
    try:
        return urlsplit(origin).netloc.lower()
    except ValueError:
        return None


async def _refuse_request(
    status: int, kind: str, message: str, scope: Scope, receive: Receive, send: Send
) -> None:
    if scope["type"] == "websocket":  # before it is accepted: the server answers 403
        await receive()
        await send({"type": "websocket.close", "code": 1008, "reason": message[:120]})
        return
    await error_response(status, kind, message)(scope, receive, send)


def _without_token(scope: Scope) -> str | None:
    """Address of a page without the token that came with it; ``None`` if none came."""
    query = parse_qs(scope["query_string"].decode("latin-1"), keep_blank_values=True)
    if scope["type"] != "http" or scope["method"] != "GET" or "token" not in query:
        return None
    del query["token"]
    path = "/" + str(scope["path"]).lstrip("/")
    return f"{path}?{urlencode(query, doseq=True)}" if query else path
