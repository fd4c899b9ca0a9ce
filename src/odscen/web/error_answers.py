"""Errors as answers: one shape for all of them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import orjson
from fastapi.exceptions import RequestValidationError
from starlette.exceptions import HTTPException
from starlette.responses import Response

from odscen.base.errors import ConflictError, InputError, NotFoundError, OdscenError, ScenarioError
from odscen.web.messages import ErrorAnswer, ErrorInfo

if TYPE_CHECKING:
    from collections.abc import Sequence

    from fastapi import FastAPI
    from starlette.requests import Request

_NAMES = {404: "NotFound", 405: "MethodNotAllowed", 413: "TooLarge", 400: "BadRequest"}

RESPONSES: dict[int | str, dict[str, Any]] = {
    status: {"model": ErrorAnswer, "description": words}
    for status, words in {
        400: "The request cannot be read.",
        401: "The token is missing.",
        403: "The request comes from a foreign page, or for another host.",
        404: "There is no such thing.",
        409: "It is taken, in use, or has changed meanwhile.",
        413: "Too large.",
        422: "What was sent cannot be used; the message says why.",
    }.items()
}
"""What every route may answer besides what it is asked for."""


def error_info(error: OdscenError) -> ErrorInfo:
    """An error of ours as data."""
    message, problems = str(error), []
    if isinstance(error, ScenarioError) and error.problems:
        problems = list(error.problems)
        message = message.split("\n  - ", maxsplit=1)[0]
    current = error.current if isinstance(error, ConflictError) else None
    kind = type(error).__name__
    return ErrorInfo(kind=kind, message=message, problems=problems, current=current)


def error_response(status: int, kind: str, message: str, problems: Sequence[str] = ()) -> Response:
    """Answer with an error."""
    return _response(status, ErrorInfo(kind=kind, message=message, problems=list(problems)))


def add_error_handlers(app: FastAPI) -> None:
    """Answer every exception in the same shape."""

    @app.exception_handler(OdscenError)
    def ours(_request: Request, error: OdscenError) -> Response:
        return _response(_status(error), error_info(error))

    @app.exception_handler(RequestValidationError)
    def invalid(_request: Request, error: RequestValidationError) -> Response:
        problems = []
        for one in error.errors():
            place = ".".join(str(step) for step in one["loc"])
            problems.append(f"{place}: {one['msg']}")
        return error_response(422, "InvalidRequest", problems[0], problems)

    @app.exception_handler(HTTPException)
    def plain(_request: Request, error: HTTPException) -> Response:
        kind = _NAMES.get(error.status_code, "HttpError")
        response = error_response(error.status_code, kind, str(error.detail))
        response.headers.update(error.headers or {})
        return response


def _status(error: OdscenError) -> int:
    if isinstance(error, NotFoundError):
        return 404
    if isinstance(error, ConflictError):
        return 409
    return 422 if isinstance(error, InputError) else 500


def _response(status: int, info: ErrorInfo) -> Response:
    body = orjson.dumps(ErrorAnswer(error=info).model_dump())
    return Response(body, status_code=status, media_type="application/json")
