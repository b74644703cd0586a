"""`swash live`: fly a vehicle or an identified model in the browser, in real time."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from swashplate.cli import conditions as given
from swashplate.cli import options
from swashplate.errors import SwashError

if TYPE_CHECKING:
    from swashplate.control.autopilot import Autopilot

Port = Annotated[int, typer.Option("--port", help="Port of the page; 0 takes any free one.", min=0, max=65535)]
Host = Annotated[str, typer.Option("--host", help="Address to listen on; other than loopback with --allow-remote.")]
Remote = Annotated[bool, typer.Option("--allow-remote", help="Let other machines open the page and fly.")]
Open = Annotated[bool, typer.Option("--open", help="Open the page in the browser.")]


def live(
    model: Annotated[
        str,
        typer.Argument(
            metavar="MODEL", help="A vehicle's name, or a card or model file.", autocompletion=options._vehicle_names
        ),
    ],
    controller: Annotated[
        Path | None,
        typer.Option("--controller", metavar="FILE", help="A controller from `swash decouple`, for a CoaX."),
    ] = None,
    out: Annotated[
        Path, typer.Option("--out", metavar="DIR", help="Folder for recordings and reports; made with the first one.")
    ] = Path("live"),
    switched: given.Switch = None,
    port: Port = 8017,
    host: Host = "127.0.0.1",
    allow_remote: Remote = False,
    open_page: Open = False,
    quiet: options.Quiet = False,
) -> None:
    """Fly a model in the browser: gamepad, keyboard or touch; record, identify, and read the report."""
    need_live_extra()
    from swashplate.cli.console import progress
    from swashplate.links.live import server

    if out.exists() and not out.is_dir():
        raise SwashError("is a file, expected a folder.", where=out, channel="--out")
    vehicle = given.vehicle_of(model, None, switched)
    if vehicle.name == "linear" and not quiet:
        typer.echo("A linear model: deviations from one trim, without ground, wind or battery.", err=True)
    from swashplate.simulation.compilation import dispatch_in_line, enable_compilation_cache

    enable_compilation_cache()
    dispatch_in_line()  # another thread would have to wait for a processor of its own at every step
    chosen = None if controller is None else _autopilot(controller)
    server.check_page()
    listening = server.listen(host, port, allow_remote=allow_remote)
    try:
        with progress(quiet=quiet) as line:
            line.say("preparing (compiling takes longest the first time)")
            from swashplate.links.live.session import Session

            session = Session(vehicle, controller=chosen, folder=out)
        session.clock.start()
        try:
            announce(server.address_of(listening), open_page=open_page, quiet=quiet)
            server.serve(server.live_app(session, remote=allow_remote), listening)
        finally:
            session.close()
    finally:
        listening.close()


def _autopilot(controller: Path) -> Autopilot:
    from swashplate.control.autopilot import Autopilot
    from swashplate.control.controller_file import read_controller

    read = read_controller(controller)
    if not isinstance(read, Autopilot):
        raise SwashError(
            "flies on sensors of its own, and the page has none.",
            where=controller,
            channel="--controller",
            hint="Give an autopilot, as `swash decouple` writes it without --sensors.",
        )
    return read


def need_live_extra() -> None:
    """That the libraries of the extra `live` are there.

    Raises:
        SwashError: saying how to install them.
    """
    from importlib.util import find_spec

    missing = [name for name in ("starlette", "uvicorn", "websockets") if find_spec(name) is None]
    if missing:
        raise SwashError(f"needs {', '.join(missing)}.", hint="Install them with: pip install swashplate[live]")


def announce(address: str, *, open_page: bool, quiet: bool) -> None:
    """Say where the page is, and open it if asked to."""
    if not quiet:
        typer.echo(f"Open {address} in a browser; Ctrl-C here ends it.")
    if open_page:
        import webbrowser

        if not webbrowser.open(address):
            typer.echo(f"No browser was found; open {address} yourself.", err=True)
