"""Files of a form that go to the disk as they come, however large they are."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from python_multipart.exceptions import FormParserError
from python_multipart.multipart import MultipartParser, parse_options_header
from starlette.concurrency import run_in_threadpool

from odscen.app.exchange.kept_recordings import SentPath
from odscen.base.errors import InputError

if TYPE_CHECKING:
    from pathlib import Path

    from starlette.requests import Request

MOST_FILES: Final = 40
_PIECE: Final = 1 << 20
"""Bytes that are written together, in another thread than that which answers requests."""
_LONGEST_FIELD: Final = 1000


async def receive_files(request: Request, folder: Path) -> tuple[list[SentPath], dict[str, str]]:
    """Write the files of a form into a folder.

    Parameters
    ----------
    folder
        Their names there are of ours, never those that were sent.

    Returns
    -------
    tuple
        Files with the names that their sender gave them, and the other fields.

    Raises
    ------
    InputError
        If the form is damaged, or has too much in it.
    """
    kind, options = parse_options_header(request.headers.get("content-type", ""))
    if kind != b"multipart/form-data" or b"boundary" not in options:
        raise InputError("it is no form with files")
    form = _Form(folder)
    try:
        parser = MultipartParser(options[b"boundary"], form.callbacks())  # type: ignore[arg-type]
        piece = bytearray()
        async for chunk in request.stream():
            piece += chunk
            if len(piece) >= _PIECE:
                await run_in_threadpool(parser.write, bytes(piece))
                piece.clear()
        await run_in_threadpool(parser.write, bytes(piece))
        parser.finalize()
        if not form.is_whole:
            raise InputError("the form ends too early")
    except FormParserError as error:
        raise InputError(f"the form is damaged: {error}") from error
    finally:
        form.close()
    return form.files, form.fields


class _Form:
    def __init__(self, folder: Path) -> None:
        self.files: list[SentPath] = []
        self.fields: dict[str, str] = {}
        self.is_whole = False
        self._folder = folder
        self._file: Any = None
        self._field = ""
        self._name, self._value = b"", b""
        self._headers: dict[bytes, bytes] = {}

    def callbacks(self) -> dict[str, Any]:
        """What the parser calls."""
        return {
            "on_part_begin": self._begin_part,
            "on_header_field": self._add_name,
            "on_header_value": self._add_value,
            "on_header_end": self._end_header,
            "on_headers_finished": self._open_part,
            "on_part_data": self._add_data,
            "on_part_end": self.close,
            "on_end": self._end_form,
        }

    def close(self) -> None:
        """Close the file that is being written."""
        if self._file is not None:
            self._file.close()
            self._file = None

    def _begin_part(self) -> None:
        self._headers.clear()
        self._name, self._value = b"", b""

    def _add_name(self, data: bytes, start: int, end: int) -> None:
        self._name += data[start:end]

    def _add_value(self, data: bytes, start: int, end: int) -> None:
        self._value += data[start:end]

    def _end_header(self) -> None:
        self._headers[self._name.lower()] = self._value
        self._name, self._value = b"", b""

    def _open_part(self) -> None:
        options = parse_options_header(self._headers.get(b"content-disposition", b""))[1]
        self._field = options.get(b"name", b"").decode("utf-8", "replace")
        if len(self.files) + len(self.fields) >= MOST_FILES:
            raise InputError(f"more than {MOST_FILES} files were sent")
        if b"filename" not in options:
            self.fields[self._field] = ""
            return
        path = self._folder / f"sent-{len(self.files)}"
        name = options[b"filename"].decode("utf-8", "replace") or "file"
        self.files.append(SentPath(name, path))
        self._file = path.open("wb")

    def _add_data(self, data: bytes, start: int, end: int) -> None:
        if self._file is not None:
            self._file.write(memoryview(data)[start:end])
            return
        text = self.fields[self._field] + data[start:end].decode("utf-8", "replace")
        if len(text) > _LONGEST_FIELD:
            raise InputError(f"{self._field!r} of the form is longer than {_LONGEST_FIELD}")
        self.fields[self._field] = text

    def _end_form(self) -> None:
        self.is_whole = True
