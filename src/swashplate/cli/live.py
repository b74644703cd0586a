"""`swash live`: fly a vehicle or an identified model in the browser, in real time."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from swashplate.cli import conditions as given
from swashplate.cli import options
from swashplate.errors import SwashError

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
        typer.Option(
            "--controller",
            metavar="FILE",
            help="A controller's file: one of `swash decouple` for all modes, any other for the mode Position.",
        ),
    ] = None,
    out: Annotated[
        Path,
        typer.Option("--out", "-o", metavar="DIR", help="Folder for recordings and reports; made with the first one."),
    ] = Path("live"),
    switched: given.Switch = None,
    estimate: options.Estimate = None,
    truth: options.Truth = None,
    posterior: given.Posterior = None,
    draws: given.Draws = 5,
    port: Port = 8017,
    host: Host = "127.0.0.1",
    allow_remote: Remote = False,
    open_page: Open = False,
    quiet: options.Quiet = False,
) -> None:
    """Fly a model in the browser: gamepad, keyboard or touch; record, identify, and read the report."""
    from swashplate.api import live as verbs
    from swashplate.cli.console import progress

    if out.exists() and not out.is_dir():
        raise SwashError("is a file, expected a folder.", where=out, channel="--out")
    vehicle = given.vehicle_of(model, None, switched, whole=True)
    if vehicle.traits.remark and not quiet:
        typer.echo(vehicle.traits.remark, err=True)
    with progress(quiet=quiet) as line:
        verbs.live(
            vehicle,
            controller=controller,
            estimate=estimate or (),
            truth=options.numbers_by_name(truth, option="--truth"),
            draws=() if posterior is None else given.drawn(vehicle, posterior, count=draws),
            folder=out,
            host=host,
            port=port,
            allow_remote=allow_remote,
            open_page=open_page,
            say=line.say,
            ready=lambda address: told(address, quiet=quiet),
            tell=lambda words: typer.echo(words, err=True),
        )


def told(address: str, *, quiet: bool) -> None:
    """Say where the page is."""
    if not quiet:
        typer.echo(f"Open {address} in a browser; Ctrl-C here ends it.")
