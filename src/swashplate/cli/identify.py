"""`swash identify`: from flights to an identified model and a report."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from swashplate.cli import flying, options
from swashplate.cli.guard import Exit

if TYPE_CHECKING:
    from collections.abc import Callable

    from swashplate.api.identification import Identification


def identify(
    vehicle: options.VehicleName,
    flight: options.Flights,
    hold_out: options.HoldOut = None,
    out: options.OutFolder = None,
    free: Annotated[
        str, typer.Option("--free", help="Ready choice (full, flight, ...) or parameter names separated by commas.")
    ] = "full",
    method: Annotated[
        str,
        typer.Option(
            "--method",
            help="filter-error, output-error, prediction-error, or another package's.",
        ),
    ] = "filter-error",
    outputs: Annotated[
        str | None,
        typer.Option("--outputs", help="Channels to fit, separated by commas; the method's own choice by default."),
    ] = None,
    fix: flying.Fix = None,
    tie: Annotated[
        list[str] | None, typer.Option("--tie", metavar="'A = B'", help="Tie a parameter to an expression.")
    ] = None,
    prior: Annotated[
        list[str] | None,
        typer.Option(
            "--prior",
            metavar="CARD|NAME=MEAN,SIGMA",
            help="What is known beforehand: a card of the bench or of another flight, or one parameter; repeatable.",
        ),
    ] = None,
    iterations: Annotated[int, typer.Option("--iterations", help="Largest number of iterations.", min=1)] = 60,
    keep_unexcited: Annotated[
        bool, typer.Option("--keep-unexcited", help="Also fit parameters of axes that no flight moves independently.")
    ] = False,
    wind: Annotated[
        bool, typer.Option("--wind", help="Estimate a horizontal wind too: flights outdoors or in strong gusts.")
    ] = False,
    rotor_line: Annotated[
        float | None,
        typer.Option(
            "--rotor-line",
            metavar="HERTZ",
            help="Model a rotor's line in the measured pose, at the signed frequency that swash rotor-speed tells.",
        ),
    ] = None,
    leave_out: Annotated[
        list[str] | None,
        typer.Option(
            "--leave-out",
            metavar="START,STOP",
            help="Learn nothing from this stretch [s], e.g. where the aircraft was touched; repeatable.",
        ),
    ] = None,
    horizon: options.HorizonAhead = None,
    residual: Annotated[
        bool,
        typer.Option(
            "--residual",
            help="Also fit accelerations that the equations lack, linear in motion and inputs, as far as blocks of the "
            "flights that are left out speak for them; with --horizon to the errors ahead (for predictions only).",
        ),
    ] = False,
    close_loop: options.CloseLoop = "",
    posterior: Annotated[
        str | None,
        typer.Option(
            "--posterior",
            metavar="laplace|nuts",
            help="Draw models from the fit's uncertainty, into posterior.nc (for ArviZ) and for Monte Carlo: "
            "laplace (normal, fast) or nuts (from the likelihood, minutes).",
        ),
    ] = None,
    rate: options.Rate = 100.0,
    cutoff: options.Cutoff = 0.0,
    mapping: options.Mapping = None,
    unit: options.Units = None,
    drop_bad_stamps: options.BadStamps = False,
    as_logged: options.AsLogged = False,
    json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Identify a vehicle from flights, validate it on others, and write a report.

    Writes report.html, model.toml, fit.json and (with --hold-out) validation.json to --out. A fit that ends at values
    which physics forbids has failed: exit code 2, a report that says so, and no model. A posterior that did not
    converge is not written: exit code 2, its diagnostics, and the fit.
    """
    import swashplate as sp
    from swashplate.cli.reading import asked, conditioned
    from swashplate.engine.roots import require_casadi
    from swashplate.identification.core.stopping import stoppable

    card, texts = options.prior_card_name(prior)
    names = list(options.names(free))
    held, priors = options.fixed_values(fix), options.prior_values(texts)
    prior_card, aircraft = None if card is None else sp.vehicle(card).card, sp.vehicle(vehicle)
    called, how = [*flight, *(hold_out or [])], asked(mapping, unit, drop_bad_stamps, as_logged)

    def make(say: Callable[..., None]) -> Identification:
        require_casadi()
        say("reading flights")
        read = conditioned(called, rate=rate, cutoff=cutoff, how=how)
        return sp.identify_and_validate(
            aircraft,
            read[: len(flight)],
            hold_out=read[len(flight) :],
            free=names[0] if len(names) == 1 else names,
            method=method,
            outputs=None if outputs is None else options.names(outputs),
            ties=tuple(tie or ()),
            fixed=held or None,
            priors=priors or None,
            prior_card=prior_card,
            iterations=iterations,
            keep_unexcited=keep_unexcited,
            wind=wind,
            rotor_line=rotor_line,
            leave_out=[(a, b) for a, b in (options.numbers(t, option="--leave-out", count=2) for t in leave_out or ())],
            horizon=options.seconds_ahead(horizon),
            residual=residual,
            close_loop=options.names(close_loop),
            posterior=posterior,
            names=called,
            say=say,
        )

    with stoppable() as stop:
        made = carried_out(make, out=out, quiet=quiet or json)
    show(made, out=out, json=json, quiet=quiet)
    if stop.code:
        flying.end_with([stop.words], code=stop.code)
    if made.fit.failed:
        typer.echo(f"The fit failed: {' '.join(made.fit.problems) or 'see the report.'}", err=True)
        raise typer.Exit(Exit.INPUT)
    if made.refused:
        flying.end_with([f"The fit is written, its posterior is not: {made.refused}"], code=Exit.INPUT)


def carried_out(
    make: Callable[[Callable[..., None]], Identification], *, out: Path | None, quiet: bool
) -> Identification:
    """What was asked, with its files, which appear in `out` together when all are complete."""
    from swashplate.api.identification import Identification
    from swashplate.cli.console import progress
    from swashplate.cli.outputs import folder_when_complete

    with progress(quiet=quiet) as line, folder_when_complete(out, ours=Identification.files) as folder:
        made = make(line.say)
        if folder is not None:
            line.say("writing the report")
            made.write(folder)
    return made


def show(made: Identification, *, out: Path | None, json: bool, quiet: bool) -> None:
    """The result on standard output: JSON, or a table, the report's own five lines and where the report is."""
    from swashplate.cli.console import as_json, console
    from swashplate.cli.tables import fit_table

    if json:
        typer.echo(as_json(made.to_document()))
    elif not quiet:
        from swashplate.cli.outputs import place_of

        fit = made.fit
        console().print(fit_table(fit) if hasattr(fit.solution, "card") else repr(fit))
        if fit.posterior is not None:
            typer.echo(f"\n{fit.posterior!r}")
        place = place_of(out, "report.html", made.files) if out else "not written (give --out DIR)"
        typer.echo("\n" + "\n".join([*made.lines(), f"Report:     {place}"]))
