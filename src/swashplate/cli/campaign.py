"""`swash campaign`: many flights, fits or logs, on every core of one machine or of many."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from swashplate.cli import options
from swashplate.errors import SwashError

if TYPE_CHECKING:
    from swashplate.api.campaigns.results import Campaign
    from swashplate.api.campaigns.scheduler import DaskScheduler

app = typer.Typer(
    help="Compute many flights, fits or logs from a TOML file, on every core of one machine or of several, "
    "into a folder. If a campaign is stopped, it continues where it was.",
    rich_markup_mode=None,
    no_args_is_help=True,
)
Store = Annotated[Path, typer.Argument(metavar="FOLDER", help="Folder of the campaign.")]
Workers = Annotated[
    int | None, typer.Option("--workers", help="Processes on this machine, one core each; by default all cores.", min=1)
]
Scheduler = Annotated[
    str | None,
    typer.Option(
        "--scheduler", metavar="ADDRESS", help="Address of a Dask scheduler, tls://host:8786, whose workers are used."
    ),
]
_PEM = "PEM file for --scheduler; by default as Dask's configuration says."
Ca = Annotated[Path | None, typer.Option("--tls-ca-file", help=f"Certificate that has signed all others: {_PEM}")]
Certificate = Annotated[Path | None, typer.Option("--tls-cert", help=f"Certificate of this client: {_PEM}")]
Key = Annotated[Path | None, typer.Option("--tls-key", help=f"Key of that certificate: {_PEM}")]
Insecure = Annotated[
    bool,
    typer.Option("--insecure", help="Take a scheduler without TLS: whoever reaches its port can run commands as you."),
]


@app.command("run", short_help="Compute a campaign, or continue one.")
def run(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="The campaign: a TOML file (docs/howto/campaigns.md).")],
    out: Annotated[Path | None, typer.Option("--out", "-o", metavar="FOLDER", help="Folder for the results.")] = None,
    workers: Workers = None,
    scheduler: Scheduler = None,
    tls_ca_file: Ca = None,
    tls_cert: Certificate = None,
    tls_key: Key = None,
    insecure: Insecure = False,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Only print cost and size: two tasks are computed.")
    ] = False,
    accept_changes: Annotated[
        bool, typer.Option("--accept-changes", help="Continue although the file or the program has changed.")
    ] = False,
    json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Compute a campaign into a folder. The same command, or `swash campaign resume`, continues one that was stopped.

    Exit code 2 if tasks failed; the results of the others are kept.
    """
    import swashplate as sp
    from swashplate.cli.console import as_json, progress

    named = _scheduler(scheduler, tls_ca_file, tls_cert, tls_key, insecure)
    with progress(quiet=quiet or json, every=_EVERY) as line:
        if dry_run:
            line.say("doing the first task twice")
            made = sp.plan_campaign(file, measure=True)
            typer.echo(as_json(made.to_document()) if json else repr(made))
            return
        if out is None:
            sp.plan_campaign(file)  # what is wrong in what was typed comes first
            raise SwashError("is missing.", channel="--out", hint="Say where results are kept: -o FOLDER.")
        study = sp.campaign(file, out, workers=workers, scheduler=named, accept_changes=accept_changes,
                            say=line.say)  # fmt: skip
    _show(study, json=json, quiet=quiet)


@app.command("resume", short_help="Continue a campaign where it stopped.")
def resume(
    folder: Store,
    workers: Workers = None,
    scheduler: Scheduler = None,
    tls_ca_file: Ca = None,
    tls_cert: Certificate = None,
    tls_key: Key = None,
    insecure: Insecure = False,
    retry_failed: Annotated[bool, typer.Option("--retry-failed", help="Try failed tasks again.")] = False,
    json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Continue a campaign from its folder, with any number of workers on any machine."""
    import swashplate as sp
    from swashplate.cli.console import progress

    named = _scheduler(scheduler, tls_ca_file, tls_cert, tls_key, insecure)
    with progress(quiet=quiet or json, every=_EVERY) as line:
        study = sp.resume_campaign(folder, workers=workers, scheduler=named, retry_failed=retry_failed, say=line.say)
    _show(study, json=json, quiet=quiet)


@app.command("status", short_help="Show the progress and the results so far of a campaign.")
def status(folder: Store, json: options.Json = False) -> None:
    """Show the progress, the workers and the results so far of a campaign, also while it runs."""
    import swashplate as sp

    _show(sp.campaign_results(folder), json=json, quiet=False, judged=False)


@app.command("report", short_help="Write the results of a campaign as a page or a table.")
def report(
    folder: Store,
    out: Annotated[
        Path, typer.Option("--out", "-o", metavar="FILE", help="A page (.html), or the table: .nc, .csv, .parquet.")
    ],
    quiet: options.Quiet = False,
) -> None:
    """Distributions, worst rows with the command that shows each again, convergence of the quantiles, and failures."""
    import swashplate as sp

    if out.suffix not in (".html", ".nc", ".csv", ".parquet"):
        raise SwashError(f"ends in '{out.suffix}', expected .html, .nc, .csv or .parquet.", where=out, channel="--out")
    study = sp.campaign_results(folder)
    written = sp.report(study, path=out) if out.suffix == ".html" else study.save(out)
    if not quiet:
        typer.echo(f"Written: {written}")
    _end_if_refused(study)


@app.command("replay", short_help="Compute one row of a campaign again.")
def replay(
    folder: Store,
    number: Annotated[int, typer.Argument(metavar="NUMBER", help="Number of the row in the report.", min=0)],
    out: Annotated[Path, typer.Option("--out", "-o", metavar="FILE", help="A flight as .nc, a fit as .json.")],
    quiet: options.Quiet = False,
) -> None:
    """Compute one row again and save it, for example the worst flight of a thousand. Its whole task is repeated."""
    import swashplate as sp
    from swashplate.cli.console import doing

    with doing("doing the row's task again", quiet=quiet):
        sp.replay_campaign(folder, number).save(out)
    if not quiet:
        typer.echo(f"Written: {out}")


_EVERY = 10.0  # s between two lines of progress in a pipe


def _scheduler(
    address: str | None, ca: Path | None, certificate: Path | None, key: Path | None, insecure: bool
) -> DaskScheduler | None:
    import swashplate as sp

    if address is None:
        if ca or certificate or key or insecure:
            raise SwashError("is missing.", channel="--scheduler", hint="Files for TLS and --insecure belong to one.")
        return None
    return sp.DaskScheduler(address, ca=ca, certificate=certificate, key=key, insecure=insecure)


def _show(study: Campaign, *, json: bool, quiet: bool, judged: bool = True) -> None:
    from swashplate.cli.console import as_json
    from swashplate.cli.flying import end_with

    if json:
        typer.echo(as_json(study.to_document()))
    elif not quiet:
        typer.echo(repr(study))
    _end_if_refused(study)
    if judged and study.failed:
        end_with(
            [f"{len(study.failed)} of {len(study.names)} tasks were given up: swash campaign status {study.folder}"]
        )


def _end_if_refused(study: Campaign) -> None:
    from swashplate.cli.flying import end_with

    end_with(list(study.refused.values())[:3])
