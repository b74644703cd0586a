"""A page's requests: a body of JSON of a known form and length in, JSON or a message in words out."""

from __future__ import annotations

import asyncio
import json
import logging
from collections.abc import Callable, Mapping
from typing import Any

from starlette.requests import Request
from starlette.responses import JSONResponse, Response

from swashplate.errors import SwashError
from swashplate.json_text import plain
from swashplate.links.web.work import in_thread

LONGEST = 64 << 10
"""Bytes of a request that is no piece of a file."""
_LOG = logging.getLogger("swashplate.open")

Check = Callable[[Any], bool]
Form = Mapping[str, Check]


class RequestError(SwashError):
    """A request that has not the form it must have."""


async def body(request: Request, *, longest: int) -> bytes:
    """A request's body, read no further than allowed.

    Raises:
        RequestError: where it is longer.
    """
    read = bytearray()
    async for piece in request.stream():
        read += piece
        if len(read) > longest:
            raise RequestError(f"the request is longer than {longest} bytes.")
    return bytes(read)


def fields(content: bytes, form: Form) -> dict[str, Any]:
    """A JSON object with exactly the fields of a form.

    Raises:
        RequestError: naming what is wrong.
    """
    try:
        message = json.loads(content)
    except (ValueError, RecursionError):
        raise RequestError("the request is no JSON.") from None
    if not isinstance(message, dict) or message.keys() != form.keys():
        raise RequestError("the request has missing or unknown fields.")
    for name, check in form.items():
        if not check(message[name]):
            raise RequestError(f"the request has a bad '{name}'.")
    return message


def json_response(result: Any, *, status: int = 200) -> Response:
    """A result as JSON; NaN becomes null."""
    return JSONResponse(plain(result), status_code=status)


def refused(error: BaseException) -> Response:
    """An error in words, without a traceback: those of a user's input as they are, others by their kind."""
    if isinstance(error, asyncio.CancelledError):
        return json_response({"problem": "swash has been ended.", "hint": ""}, status=503)
    if isinstance(error, RequestError):
        return json_response({"problem": error.problem, "hint": ""}, status=400)
    if isinstance(error, SwashError):
        place = f"{error.channel}: " if error.channel else ""
        return json_response({"problem": f"{place}{error.problem}", "hint": error.hint or ""}, status=422)
    _LOG.error("A request failed: %s: %s", type(error).__name__, error)
    problem = f"This went wrong inside swash ({type(error).__name__}: {error}). The other views go on working."
    return json_response({"problem": problem, "hint": "Please report it with the log."}, status=500)


def post(form: Form, work: Callable[..., Any]) -> Callable[[Request], Any]:
    """An endpoint that checks a body and calls `work` with its fields, in a thread of its own."""

    async def answer(request: Request) -> Response:
        try:
            message = fields(await body(request, longest=LONGEST), form)
            return json_response(await in_thread(work, **message))
        except (Exception, asyncio.CancelledError) as error:  # whatever it is, the page hears it in words
            return refused(error)

    return answer


def get(work: Callable[[], Any]) -> Callable[[Request], Any]:
    """An endpoint that answers with what `work` returns, made in a thread of its own."""

    async def answer(_: Request) -> Response:
        try:
            return json_response(await in_thread(work))
        except (Exception, asyncio.CancelledError) as error:
            return refused(error)

    return answer


# ---- what a field may be ---------------------------------------------------------------------------------------------
def integer(low: int, high: int) -> Check:
    """A whole number between two, both included."""
    return lambda value: isinstance(value, int) and not isinstance(value, bool) and low <= value <= high


def number(value: Any) -> bool:
    """A finite number."""
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) < 1e15


def switch(value: Any) -> bool:
    """True or false."""
    return isinstance(value, bool)


def text(longest: int, *, least: int = 1) -> Check:
    """Text of limited length."""
    return lambda value: isinstance(value, str) and least <= len(value) <= longest


def rows(most: int, *cells: Check) -> Check:
    """A list of rows with these cells each."""

    def check(value: Any) -> bool:
        return (
            isinstance(value, list)
            and len(value) <= most
            and all(
                isinstance(row, list)
                and len(row) == len(cells)
                and all(cell(entry) for cell, entry in zip(cells, row, strict=True))
                for row in value
            )
        )

    return check


def names(most: int, longest: int) -> Check:
    """An object of short texts by short names."""

    def check(value: Any) -> bool:
        short = text(longest)
        return isinstance(value, dict) and len(value) <= most and all(short(k) and short(v) for k, v in value.items())

    return check
