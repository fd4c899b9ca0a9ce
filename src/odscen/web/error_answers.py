"""Errors as answers: one shape for all of them."""

from __future__ import annotations

import errno
from typing import TYPE_CHECKING, Any

import orjson
from fastapi.exceptions import RequestValidationError
from starlette.exceptions import HTTPException
from starlette.responses import Response

from odscen.base.errors import (
    ConflictError,
    DamagedError,
    InputError,
    NotFoundError,
    OdscenError,
    ResourceError,
    ScenarioError,
    WorkspaceError,
)
from odscen.base.shown import printable
from odscen.web.messages import ErrorAnswer, ErrorInfo

if TYPE_CHECKING:
    from collections.abc import Sequence

    from fastapi import FastAPI
    from starlette.requests import Request

_NAMES = {
    400: "BadRequest",
    404: "NotFound",
    405: "MethodNotAllowed",
    408: "TooSlow",
    413: "TooLarge",
}
_FULL = frozenset({errno.ENOSPC, errno.EDQUOT})
_FAULT = "the server has a fault of its own: {}; what it printed belongs into a report of it"

_STATUSES = {
    400: "The request cannot be read.",
    401: "The token is missing.",
    403: "The request comes from a foreign page, or for another host.",
    404: "There is no such thing.",
    408: "The rest of the request did not come in time.",
    409: "It is taken, in use, damaged, or has changed meanwhile.",
    413: "Too large.",
    422: "What was sent cannot be used; the message says why.",
    503: "The workspace cannot be read or written now, or memory is short.",
    507: "The disk is full.",
}
ERROR_RESPONSES: dict[int | str, dict[str, Any]] = {
    "default": {
        "model": ErrorAnswer,
        "description": " ".join(f"{status}: {words}" for status, words in _STATUSES.items()),
    }
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
    return _error_answer_response(
        status, ErrorInfo(kind=kind, message=message, problems=list(problems))
    )


def add_error_handlers(app: FastAPI) -> None:
    """Answer every exception in the same shape."""

    @app.exception_handler(OdscenError)
    def ours(_request: Request, error: OdscenError) -> Response:
        return _error_answer_response(_status_of_error(error), error_info(error))

    @app.exception_handler(RequestValidationError)
    def invalid(_request: Request, error: RequestValidationError) -> Response:
        problems = []
        for problem in error.errors():
            place = ".".join(str(step) for step in problem["loc"])
            problems.append(f"{place}: {problem['msg']}")
        return error_response(422, "InvalidRequest", problems[0], problems)

    @app.exception_handler(HTTPException)
    def plain(_request: Request, error: HTTPException) -> Response:
        if isinstance(error.__cause__, OSError | MemoryError):  # a body that found no room
            return _answer_machine_error(error.__cause__)
        kind = _NAMES.get(error.status_code, "HttpError")
        response = error_response(error.status_code, kind, str(error.detail))
        response.headers.update(error.headers or {})
        return response

    @app.exception_handler(OSError)
    @app.exception_handler(MemoryError)
    def machine(_request: Request, error: OSError | MemoryError) -> Response:
        return _answer_machine_error(error)

    @app.exception_handler(Exception)
    def unknown(_request: Request, error: Exception) -> Response:
        return error_response(500, "ServerFault", _FAULT.format(type(error).__name__))


def _answer_machine_error(error: OSError | MemoryError) -> Response:
    """Answer with what the disk or the memory refuses, and with what can be done."""
    if isinstance(error, FileNotFoundError):
        message = f"{_name_of_file(error)} is not there any more; it was removed or is damaged"
        return error_response(404, "NotFound", message)
    if isinstance(error, MemoryError):
        return error_response(503, "OutOfMemory", "memory is short; end a run, then try again")
    message = f"{error.strerror or error} ({_name_of_file(error)})"
    if error.errno in _FULL:
        return error_response(507, "DiskFull", f"{message}; make room on the disk, then try again")
    return error_response(503, "DiskFault", message)


def _name_of_file(error: OSError) -> str:
    return printable(str(error.filename or "the server's disk"))


def _status_of_error(error: OdscenError) -> int:
    if isinstance(error, NotFoundError):
        return 404
    if isinstance(error, ConflictError | DamagedError):  # what is there is taken, or damaged
        return 409
    if isinstance(error, InputError):
        return 422
    if not isinstance(error, WorkspaceError):
        return 500
    cause = error.__cause__
    if isinstance(cause, OSError):
        return 507 if cause.errno in _FULL else 503
    # else what is there is damaged, and can be repaired
    return 503 if isinstance(error, ResourceError) else 409


def _error_answer_response(status: int, info: ErrorInfo) -> Response:
    body = orjson.dumps(ErrorAnswer(error=info).model_dump())
    return Response(body, status_code=status, media_type="application/json")
