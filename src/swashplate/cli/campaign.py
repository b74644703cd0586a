"""`swash campaign`: many flights, fits or logs, on every core of one machine or of many."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from swashplate.cli import options
from swashplate.errors import SwashError

if TYPE_CHECKING:
    from swashplate.api.campaigns.results import Campaign

app = typer.Typer(
    help="Many flights, fits or logs, as a TOML file says, on every core of one machine or of many, kept in a folder. "
    "Killed at any moment, a campaign goes on where it was.",
    rich_markup_mode=None,
    no_args_is_help=True,
)
Store = Annotated[Path, typer.Argument(metavar="FOLDER", help="Of the campaign.")]
Workers = Annotated[
    int | None, typer.Option("--workers", help="Processes on this machine, one core each; by default all cores.", min=1)
]
Scheduler = Annotated[
    str | None,
    typer.Option("--scheduler", metavar="ADDRESS", help="A Dask scheduler, tcp://host:8786, whose workers are taken."),
]
Engine = Annotated[
    str | None,
    typer.Option("--engine", help="dask or processes (without any library); by default Dask where it is installed."),
]


@app.command("run", short_help="Compute a campaign, or what is left of it.")
def run(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="The campaign: a TOML file (docs/howto/campaigns.md).")],
    out: Annotated[Path | None, typer.Option("--out", "-o", metavar="FOLDER", help="Where results are kept.")] = None,
    workers: Workers = None,
    scheduler: Scheduler = None,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Say cost and size only: two tasks are done.")] = False,
    accept_changes: Annotated[
        bool, typer.Option("--accept-changes", help="Go on though the file or the program has changed.")
    ] = False,
    engine: Engine = None,
    json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Compute a campaign into a folder. The same command, or `swash campaign resume`, goes on with what is left of one.

    Exit code 2 where tasks were given up; the others are there.
    """
    import swashplate as sp
    from swashplate.cli.console import as_json, progress

    with progress(quiet=quiet or json, every=_EVERY) as line:
        if dry_run:
            line.say("doing the first task twice")
            made = sp.plan_campaign(file, measure=True)
            typer.echo(as_json(made.to_document()) if json else repr(made))
            return
        if out is None:
            raise SwashError("is missing.", channel="--out", hint="Say where results are kept: -o FOLDER.")
        found = sp.campaign(file, out, workers=workers, scheduler=scheduler, engine=_engine(engine),
                            accept_changes=accept_changes, say=line.say)  # fmt: skip
    _show(found, json=json, quiet=quiet)


@app.command("resume", short_help="Go on with a campaign where it was.")
def resume(
    folder: Store,
    workers: Workers = None,
    scheduler: Scheduler = None,
    retry_failed: Annotated[bool, typer.Option("--retry-failed", help="Try tasks again that were given up.")] = False,
    engine: Engine = None,
    json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Go on with a campaign from its folder alone, with as many workers as you like, wherever they are."""
    import swashplate as sp
    from swashplate.cli.console import progress

    with progress(quiet=quiet or json, every=_EVERY) as line:
        found = sp.resume_campaign(folder, workers=workers, scheduler=scheduler, engine=_engine(engine),
                                   retry_failed=retry_failed, say=line.say)  # fmt: skip
    _show(found, json=json, quiet=quiet)


@app.command("status", short_help="How far a campaign is, and what it has found so far.")
def status(folder: Store, json: options.Json = False) -> None:
    """How far a campaign is, who is at work, and what it has found so far; also while it is computed."""
    import swashplate as sp

    _show(sp.campaign_results(folder), json=json, quiet=False, judged=False)


@app.command("report", short_help="Write what a campaign has found as a page or a table.")
def report(
    folder: Store,
    out: Annotated[Path, typer.Option("--out", "-o", metavar="FILE", help="A page (.html), or the table: .nc, .csv.")],
    quiet: options.Quiet = False,
) -> None:
    """Distributions, worst rows with the command that shows each again, convergence of the quantiles, and failures."""
    import swashplate as sp

    found = sp.campaign_results(folder)
    written = sp.report(found, path=out) if out.suffix == ".html" else found.save(out)
    if not quiet:
        typer.echo(f"Written: {written}")


@app.command("replay", short_help="Compute one row of a campaign again, whole.")
def replay(
    folder: Store,
    number: Annotated[int, typer.Argument(metavar="NUMBER", help="Of the row, as the report has it.", min=0)],
    out: Annotated[Path, typer.Option("--out", "-o", metavar="FILE", help="A flight as .nc, a fit as .json.")],
    quiet: options.Quiet = False,
) -> None:
    """The worst flight of a thousand, as a flight to look at: its task is done again as a worker does it."""
    import swashplate as sp
    from swashplate.cli.console import doing

    with doing("doing the row's task again", quiet=quiet):
        sp.replay_campaign(folder, number).save(out)
    if not quiet:
        typer.echo(f"Written: {out}")


_EVERY = 10.0  # s between two lines of progress in a pipe


def _engine(name: str | None) -> Literal["dask", "processes"] | None:
    if name is None:
        return None
    if name in ("dask", "processes"):
        return "dask" if name == "dask" else "processes"
    raise SwashError(f"is '{name}', expected dask or processes.", channel="--engine")


def _show(found: Campaign, *, json: bool, quiet: bool, judged: bool = True) -> None:
    from swashplate.cli.console import as_json
    from swashplate.cli.flying import end_with

    if json:
        typer.echo(as_json(found.to_document()))
    elif not quiet:
        typer.echo(repr(found))
    if judged and found.failed:
        end_with(
            [f"{len(found.failed)} of {len(found.names)} tasks were given up: swash campaign status {found.folder}"]
        )
