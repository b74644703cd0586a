"""`swash bench`: a folder of bench records becomes a card; the measurement plan; records of the virtual bench."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from swashplate.cli import options
from swashplate.cli.usual_verb import usual
from swashplate.errors import SwashError
from swashplate.models.usual import USUAL

_EVALUATE = "evaluate"

app = typer.Typer(
    cls=usual(_EVALUATE),
    help="From a folder of bench records to a parameter card: `swash bench DIR --out card.toml --report report.html`.",
    rich_markup_mode=None,
    no_args_is_help=True,
)

_Vehicle = Annotated[str, typer.Option("--vehicle", help="The published card: a vehicle's name, or a file.")]
_Only = Annotated[
    list[str] | None, typer.Option("--only", metavar="PROCEDURE", help="Only this procedure; may be repeated.")
]


@app.command(_EVALUATE)
def evaluate(
    records: Annotated[
        list[str],
        typer.Argument(
            metavar="RECORDS",
            help="Folder with one file a record, files, or a data set's name (coax56, coax56/bench_input_to_rpm).",
        ),
    ],
    out: Annotated[Path | None, typer.Option("--out", "-o", metavar="FILE", help="The card (.toml).")] = None,
    report: Annotated[Path | None, typer.Option("--report", metavar="FILE", help="The report (.html).")] = None,
    vehicle: _Vehicle = USUAL,
    json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Evaluate records; a contradiction in one of them ends without a card.

    The card has value, standard deviation, source files and procedure of what was measured, and the published value
    of what was not. Records are this project's CSV files or the CoaX-56's bench tables (.mat).
    """
    from swashplate.atomic import write_text
    from swashplate.bench.record_files import read_records
    from swashplate.cli.console import as_json, console, progress
    from swashplate.models.catalogue import vehicle as find

    _check_places(out, report)
    aircraft = find(vehicle)
    with progress(quiet=quiet or json) as line:
        line.say("reading records")
        read = read_records(*records)
        line.say("evaluating the bench")
        from swashplate.api.bench import document, doubts, evaluate_bench

        evaluation = evaluate_bench(*read, vehicle=aircraft)
        if out is not None and not evaluation.names:
            from swashplate.reporting.words import listed

            raise SwashError(
                f"nothing in {listed([record.name for record in read])} is a parameter of the card.",
                channel="--out",
                hint="Leave --out away; the findings are printed, and stand in the report.",
            )
        if report is not None:
            line.say("writing the report")
            from swashplate.reporting.bench import bench_report

            bench_report(evaluation, path=report)
        if out is not None:
            write_text(out, evaluation.model.card.to_toml())
    if json:
        typer.echo(as_json(document(evaluation)))
    elif not quiet:
        from swashplate.cli.bench_tables import bench_tables

        for made in bench_tables(evaluation):
            console().print(made)
        lines = [f"! {words}" for words in doubts(evaluation)]
        lines += [f"Left out: {words}" for result in evaluation.details.results for words in result.left_out]
        if evaluation.names and evaluation.details.kept:
            lines.append(f"Kept as published, no record: {', '.join(evaluation.details.kept)}")
        if evaluation.names:
            lines.append(f"Card:   {out or 'not written (give --out FILE)'}")
        lines.append(f"Report: {report or 'not written (give --report FILE)'}")
        typer.echo("\n" + "\n".join(lines))


@app.command("plan")
def plan(
    vehicle: _Vehicle = USUAL,
    only: _Only = None,
    accuracy: Annotated[
        float, typer.Option("--accuracy", help="Required relative standard deviation.", min=1e-5, max=1.0)
    ] = 0.01,
    json: options.Json = False,
) -> None:
    """Print the measurement plan: the records, how long each takes, and how many passes the wanted accuracy needs."""
    from swashplate.bench.plan import plan as make
    from swashplate.cli.console import as_json, console
    from swashplate.cli.tables import table
    from swashplate.models.catalogue import vehicle as find

    made = make(find(vehicle), only=tuple(only or ()), accuracy=accuracy)
    if json:
        typer.echo(as_json(made.as_dict()))
        return
    screen = console()
    rows = [(r.name, ", ".join(r.procedures), f"{r.duration:.0f}", r.words) for r in made.records]
    first = table(("record", "procedure", "seconds", "points"), rows, left=2, words=(3,))
    screen.print(first)
    typer.echo(f"\nOne pass takes {made.duration / 60.0:.0f} min of records. It gives, on the virtual bench:\n")
    cells = [
        (a.name, f"{a.value:.5g}", f"{a.sigma:.2g}", a.unit, str(a.repeats or "too many"), ", ".join(a.procedures))
        for a in made.aims
    ]
    head = ("parameter", "value", "sigma", "unit", f"passes for {100 * accuracy:g} %", "by")
    screen.print(table(head, cells, words=(3, 5)))


@app.command("simulate")
def simulate(
    out: Annotated[Path, typer.Argument(metavar="DIR", help="Folder for the records; it is made if missing.")],
    vehicle: _Vehicle = USUAL,
    only: _Only = None,
    repeats: Annotated[int, typer.Option("--repeats", help="Passes through the points of each record.", min=1)] = 1,
    seed: Annotated[int, typer.Option("--seed", help="Seed of noise, bias, drift and vibration.", min=0)] = 0,
    quiet: options.Quiet = False,
) -> None:
    """Make the records of the virtual bench: the vehicle held still, by the equations of flight."""
    from swashplate.cli.console import progress
    from swashplate.cli.outputs import folder_when_complete
    from swashplate.models.catalogue import vehicle as find

    aircraft = find(vehicle)
    with progress(quiet=quiet) as line:
        line.say("simulating the bench (compiling takes longest the first time)")
        from swashplate.api.bench import simulate_bench
        from swashplate.bench.record import write_record

        records = simulate_bench(aircraft, only=tuple(only or ()), repeats=repeats, seed=seed)
        with folder_when_complete(out, ours=()) as folder:
            assert folder is not None
            for record in records:
                write_record(record, folder / record.name)
    if not quiet:
        typer.echo(f"{len(records)} records in {out}: {', '.join(record.name for record in records)}")


def _check_places(out: Path | None, report: Path | None) -> None:
    """That files can be written before anything is computed."""
    for place, suffix, option in ((out, ".toml", "--out"), (report, ".html", "--report")):
        if place is None:
            continue
        if place.suffix.lower() != suffix:
            raise SwashError(f"ends in '{place.suffix}', expected {suffix}.", where=place, channel=option)
        if not place.absolute().parent.is_dir():
            raise SwashError("the folder does not exist.", where=place.parent, channel=option, hint="Make it first.")
