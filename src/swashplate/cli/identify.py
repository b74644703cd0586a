"""`swash identify`: from flights to an identified model and a report."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from swashplate.cli import options
from swashplate.cli.guard import Exit
from swashplate.cli.reading import Reading

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from swashplate.cli.console import Progress
    from swashplate.flights.flight import Flight
    from swashplate.identification.core.result import Result
    from swashplate.identification.time.flight_details import FlightDetails
    from swashplate.models.card import Card
    from swashplate.models.vehicle import Vehicle
    from swashplate.validation.validation import Validation

FILES = ("report.html", "model.toml", "fit.json", "validation.json")
"""What `--out` gets."""


class Method(StrEnum):
    PREDICTION_ERROR = "prediction-error"
    OUTPUT_ERROR = "output-error"
    NELDER_MEAD = "nelder-mead"


@dataclass(frozen=True)
class AskedIdentification:
    """What an identification is asked.

    Attributes:
        free: a ready choice or parameter names.
        method, ties, fixed, priors, prior_card, iterations, keep_unexcited, wind, horizon: as in `swashplate.identify`.
    """

    free: str | Sequence[str] = "full"
    method: str = "prediction-error"
    ties: Sequence[str] = ()
    fixed: Mapping[str, float] | None = None
    priors: Mapping[str, tuple[float, float]] | None = None
    prior_card: Card | None = None
    iterations: int = 60
    keep_unexcited: bool = False
    wind: bool = False
    horizon: Sequence[float] | None = None


def identify(
    vehicle: options.VehicleName,
    flight: options.Flights,
    hold_out: options.HoldOut = None,
    out: options.OutFolder = None,
    free: Annotated[
        str, typer.Option("--free", help="Ready choice (full, flight, ...) or parameter names separated by commas.")
    ] = "full",
    method: Annotated[Method, typer.Option("--method", help="How to estimate.")] = Method.PREDICTION_ERROR,
    fix: Annotated[
        list[str] | None, typer.Option("--fix", metavar="NAME=VALUE", help="Hold a parameter at a value.")
    ] = None,
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
    iterations: Annotated[int, typer.Option("--iterations", help="At most so many iterations.", min=1)] = 60,
    keep_unexcited: Annotated[
        bool, typer.Option("--keep-unexcited", help="Also fit parameters of axes that no flight moves independently.")
    ] = False,
    wind: Annotated[
        bool, typer.Option("--wind", help="Estimate a horizontal wind too: flights outdoors or in strong gusts.")
    ] = False,
    horizon: options.HorizonAhead = None,
    rate: options.Rate = 100.0,
    cutoff: options.Cutoff = 0.0,
    mapping: options.Mapping = None,
    unit: options.Units = None,
    drop_bad_stamps: options.BadStamps = False,
    json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Identify a vehicle from flights, validate it on others, and write a report.

    Writes report.html, model.toml, fit.json and (with --hold-out) validation.json to --out. A fit that ends at values
    which physics forbids has failed: exit code 2, a report that says so, and no model.
    """
    from swashplate.cli.console import progress
    from swashplate.models.catalogue import vehicle as find

    card, texts = options.prior_card_name(prior)
    names = [name.strip() for name in free.split(",") if name.strip()]
    question = AskedIdentification(
        free=names[0] if len(names) == 1 else names,
        method=method.value,
        ties=tuple(tie or ()),
        fixed=options.fixed_values(fix) or None,
        priors=options.prior_values(texts) or None,
        prior_card=None if card is None else find(card).card,
        iterations=iterations,
        keep_unexcited=keep_unexcited,
        wind=wind,
        horizon=options.seconds_ahead(horizon),
    )
    aircraft = find(vehicle)
    how = Reading(mapping, options.assignments(unit, option="--unit"), drop_bad_stamps)
    with progress(quiet=quiet or json) as line:
        fitted, kept = _read(flight, hold_out or [], rate=rate, cutoff=cutoff, how=how, line=line)
        fit, validation = run(aircraft, fitted, kept, question, out=out, line=line)
    show(fit, validation, out=out, json=json, quiet=quiet)
    if fit.failed:
        typer.echo(f"The fit failed: {' '.join(fit.problems) or 'see the report.'}", err=True)
        raise typer.Exit(Exit.INPUT)


def _read(
    flights: Sequence[str], hold_outs: Sequence[str], *, rate: float, cutoff: float, how: Reading, line: Progress
) -> tuple[list[Flight], list[Flight]]:
    from swashplate.cli.reading import check_disjoint, conditioned

    line.say("reading flights")
    names = [*flights, *hold_outs]
    read = conditioned(names, rate=rate, cutoff=cutoff, how=how)
    check_disjoint(read, names)
    return read[: len(flights)], read[len(flights) :]


def run(
    vehicle: Vehicle,
    flights: list[Flight],
    hold_outs: list[Flight],
    question: AskedIdentification,
    *,
    out: Path | None,
    line: Progress,
) -> tuple[Result[Vehicle, FlightDetails], Validation | None]:
    """Identifies, validates and writes the files; they appear in `out` together when all are complete."""
    import swashplate as sp
    from swashplate.cli.outputs import folder_when_complete
    from swashplate.identification.core.parameters import parameterize
    from swashplate.identification.core.records import records

    # What can be said without computing is said at once, before the seconds that loading and compiling take.
    free, ties = question.free, question.ties
    parameterize(vehicle, free, ties=ties, fixed=question.fixed, priors=question.priors, prior_card=question.prior_card)
    records([*flights, *hold_outs], vehicle)
    with folder_when_complete(out, ours=FILES) as folder:
        line.say("preparing the fit (compiling takes longest the first time)")
        fit = sp.identify(
            vehicle,
            flights,
            free=free,
            method=question.method,
            ties=ties,
            fixed=question.fixed,
            priors=question.priors,
            prior_card=question.prior_card,
            iterations=question.iterations,
            keep_unexcited=question.keep_unexcited,
            wind=question.wind,
            horizon=question.horizon,
            progress=lambda i, cost: line.say(
                "fitting", done=i, total=question.iterations, note=f"iteration {i}, cost {cost:.6g}"
            ),
        )
        validation = None
        if hold_outs and not fit.failed:
            line.say("validating on what the fit has not seen")
            validation = sp.validate(
                fit,
                hold_outs,
                progress=lambda i, n: line.say("validating on what the fit has not seen", done=i, total=n),
            )
        if folder is not None:
            line.say("writing the report")
            write(fit, validation, folder=folder)
    return fit, validation


def write(fit: Result[Vehicle, FlightDetails], validation: Validation | None, *, folder: Path) -> None:
    """All files of an identification; a failed one has no model."""
    import swashplate as sp
    from swashplate.atomic import write_text
    from swashplate.cli.console import as_json

    sp.report(fit, validation, path=folder / "report.html")
    fit.save(folder / "fit.json")
    if validation is not None:
        write_text(folder / "validation.json", as_json(validation.as_dict()) + "\n")
    if not fit.failed:
        fit.model.save(folder / "model.toml")


def show(
    fit: Result[Vehicle, FlightDetails], validation: Validation | None, *, out: Path | None, json: bool, quiet: bool
) -> None:
    """The result on standard output: JSON, or a table, the report's own five lines and where the report is."""
    from swashplate.cli.console import as_json, console
    from swashplate.cli.tables import fit_table
    from swashplate.reporting.summary import banners, summary

    if json:
        typer.echo(
            as_json({"fit": fit.to_document(comparisons=False), "validation": validation and validation.as_dict()})
        )
    elif not quiet:
        console().print(fit_table(fit))
        lines = [f"! {text}" for _, text in banners(fit, validation)]
        lines += [f"{label + ':':11} {words}" for label, words, _ in summary(fit, validation)]
        lines += [f"Report:     {out / 'report.html' if out else 'not written (give --out DIR)'}"]
        typer.echo("\n" + "\n".join(lines))
