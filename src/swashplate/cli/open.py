"""`swash open`: one local page for any log."""

from __future__ import annotations

from typing import Annotated

import typer

from swashplate.cli import live, options

Remote = Annotated[bool, typer.Option("--allow-remote", help="Let other machines open the page and its logs.")]


def open_(
    logs: Annotated[
        list[str] | None,
        typer.Argument(metavar="[LOG]...", help="Logs to look at; more may be dropped onto the page."),
    ] = None,
    mapping: options.Mapping = None,
    unit: options.Units = None,
    drop_bad_stamps: options.BadStamps = False,
    port: Annotated[
        int | None,
        typer.Option("--port", help="Port of the page; 0 takes any free one. If not given: 8019.", min=0, max=65535),
    ] = None,
    host: live.Host = "127.0.0.1",
    allow_remote: Remote = False,
    open_page: live.Open = False,
    quiet: options.Quiet = False,
) -> None:
    """Look at logs in the browser: plots, problems and their corrections, events, spectra, track, sweeps to gains.

    Without a log the page offers examples that come with the package, and a place to drop files; `swash` alone opens
    it. Every view says which command and which lines of Python do the same.
    """
    from swashplate.api.open_logs import open_logs
    from swashplate.cli.console import progress

    with progress(quiet=quiet) as line:
        open_logs(
            logs or (),
            units=options.assignments(unit, option="--unit"),
            mapping=mapping,
            bad_stamps="drop" if drop_bad_stamps else "error",
            host=host,
            port=port,
            allow_remote=allow_remote,
            open_page=open_page,
            say=line.say,
            ready=lambda address: live.told(address, quiet=quiet),
        )
