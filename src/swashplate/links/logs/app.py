"""The addresses of `swash open`: the page, the logs on it, pieces of dropped files, and what is drawn."""

from __future__ import annotations

import asyncio
from pathlib import Path
from typing import Any

from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import FileResponse, PlainTextResponse, Response
from starlette.routing import Mount, Route
from starlette.staticfiles import StaticFiles
from starlette.types import ASGIApp

from swashplate.links.logs import requests as ask
from swashplate.links.logs.columns import apply_columns, columns_of
from swashplate.links.logs.desk import BINS, MOST_LOGS, Desk
from swashplate.links.logs.flight_review import review_of
from swashplate.links.logs.map import map_of
from swashplate.links.logs.remedies import Remedy
from swashplate.links.logs.spectra import spectra
from swashplate.links.logs.track import track
from swashplate.links.logs.uploads import PIECE
from swashplate.links.web.guard import Guard
from swashplate.links.web.libraries import PAGE as SHARED
from swashplate.links.web.serving import page
from swashplate.links.web.work import in_thread

PAGE = Path(__file__).parent / "page"
_LOG = ask.integer(1, 10_000)
_NAME = ask.text(200)
_MOST_TRACES = 400


def logs_app(desk: Desk, *, remote: bool = False) -> ASGIApp:
    """The page for any log."""

    async def piece(request: Request) -> Response:
        try:
            content = await ask.body(request, longest=PIECE)
            path = desk.uploads.add(request.path_params["token"], request.path_params["at"], content)
            if path is None:
                return ask.json_response({})
            opened = await in_thread(desk.open, path=path)
            return ask.json_response({"log": opened.number})
        except (Exception, asyncio.CancelledError) as error:
            return ask.refused(error)

    def begin(name: str, size: int) -> dict[str, Any]:
        return {"token": desk.uploads.begin(name, size)}

    def close(log: int) -> dict[str, Any]:
        desk.drop(log)
        return {}

    def apply(log: int, units: dict[str, str], drop_bad_stamps: bool) -> dict[str, Any]:
        return desk.apply(log, Remedy(units, drop_bad_stamps)).to_document()

    def traces(wanted: list[list[Any]], bins: int) -> dict[str, Any]:
        rows = [(int(log), str(name), float(start), float(stop)) for log, name, start, stop in wanted]
        return {"traces": desk.traces(rows, bins=bins)}

    def plot_code(wanted: list[list[Any]], span: list[list[float]]) -> dict[str, str]:
        chosen = [(int(log), str(name)) for log, name in wanted]
        return desk.plot_code(chosen, (span[0][0], span[0][1]) if span else None)

    async def download(request: Request) -> Response:
        name = request.path_params["name"]
        try:
            path = await in_thread(desk.job.file, name=name)
        except (Exception, asyncio.CancelledError) as error:
            return ask.refused(error)
        if path is None or not path.is_file():
            return PlainTextResponse("No such file.\n", status_code=404)
        shown = "inline" if name == "report.html" else "attachment"
        return FileResponse(path, filename=name, content_disposition_type=shown)

    routes = [
        Route("/", page(PAGE / "open.html")),
        Mount("/page", StaticFiles(directory=SHARED)),
        Mount("/open", StaticFiles(directory=PAGE)),
        Route("/logs", ask.get(desk.to_document)),
        _post("/upload", begin, name=ask.text(1000), size=ask.integer(0, 1 << 50)),
        Route("/upload/{token}/{at:number}", piece, methods=["POST"]),
        _post("/example", lambda file: {"log": desk.open_example(file).number}, file=_NAME),
        _post("/fly", desk.cockpit.begin),
        _post("/close", close, log=_LOG),
        _post("/apply", apply, log=_LOG, units=ask.names(200, 60), drop_bad_stamps=ask.switch),
        _post(
            "/traces",
            traces,
            wanted=ask.rows(_MOST_TRACES, _LOG, _NAME, ask.number, ask.number),
            bins=ask.integer(2, BINS),
        ),
        _post(
            "/plot-code",
            plot_code,
            wanted=ask.rows(_MOST_TRACES, _LOG, _NAME),
            span=ask.rows(1, ask.number, ask.number),
        ),
        _post(
            "/spectra",
            lambda log, channel, start, stop: spectra(desk.log(log), channel, start, stop),
            log=_LOG,
            channel=_NAME,
            start=ask.number,
            stop=ask.number,
        ),
        _post("/columns", lambda log: columns_of(desk.log(log)), log=_LOG),
        _post(
            "/map-columns",
            lambda log, rows, rate: apply_columns(desk.log(log), rows, rate),
            log=_LOG,
            rows=ask.rows(300, ask.integer(0, 10_000), _NAME, ask.text(60, least=0), ask.number, ask.number),
            rate=ask.number,
        ),
        _post("/review", lambda log: review_of(desk.log(log)), log=_LOG),
        _post("/map", lambda log: map_of(desk.log(log)), log=_LOG),
        _post("/track", lambda log: track(desk.log(log)), log=_LOG),
        _post("/align", desk.align, first=_LOG, second=_LOG),
        _post(
            "/identify",
            lambda log, sweep, input, output: desk.identify(log, sweep, input, output),
            log=_LOG,
            sweep=ask.integer(0, 1000),
            input=ask.text(200, least=0),
            output=ask.text(200, least=0),
        ),
        _post("/cancel", desk.job.cancel),
        Route("/job", ask.get(desk.job.to_document)),
        Route("/download/{name}", download),
        _post("/common", desk.common, numbers=_numbers),
    ]
    return Guard(Starlette(routes=routes), remote=remote)


def _post(address: str, work: Any, **form: ask.Check) -> Route:
    return Route(address, ask.post(form, work), methods=["POST"])


def _numbers(value: Any) -> bool:
    return isinstance(value, list) and len(value) <= MOST_LOGS and all(map(_LOG, value))
