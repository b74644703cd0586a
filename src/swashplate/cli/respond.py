"""`swash respond`: frequency responses from the logs of sweeps."""

from __future__ import annotations

from typing import Annotated

import typer

from swashplate.cli import flying, options
from swashplate.errors import SwashError

FILES = (flying.RESPONSES, "responses.json", "report.html")


def respond(
    log: Annotated[
        list[str], typer.Argument(metavar="LOG...", help="Logs of sweeps; FILE@5-30 takes seconds 5 to 30.")
    ],
    inputs: Annotated[
        str,
        typer.Option("--inputs", help="Input channels, separated by commas: all that moved; NAME=CHANNEL renames."),
    ],
    outputs: Annotated[
        str, typer.Option("--outputs", help="Output channels, separated by commas; NAME=CHANNEL renames, as az=az_sid.")
    ],
    out: options.OutFolder = None,
    references: Annotated[
        str,
        typer.Option(
            "--references", help="Injected excitation, for logs flown in a loop: the joint input-output estimate."
        ),
    ] = "",
    band: flying.BandOption = None,
    windows: Annotated[
        str | None, typer.Option("--windows", help="Window lengths in s, separated by commas; by the book's rules.")
    ] = None,
    direct: Annotated[
        bool, typer.Option("--direct", help="Direct estimate only: do not use sweeps in the inputs as references.")
    ] = False,
    rate: options.Rate = 100.0,
    cutoff: options.Cutoff = 0.0,
    mapping: options.Mapping = None,
    unit: options.Units = None,
    drop_bad_stamps: options.BadStamps = False,
    as_logged: options.AsLogged = False,
    json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Frequency responses of outputs to inputs: conditioned on all inputs, composite over windows, with errors.

    Writes responses.nc, responses.json and report.html to --out. What could not be computed is named with exit code 2;
    the rest is written and marked.
    """
    import swashplate as sp
    from swashplate.atomic import write_json
    from swashplate.cli.console import as_json, progress
    from swashplate.cli.outputs import folder_when_complete, told
    from swashplate.cli.reading import asked, read_all
    from swashplate.flights.overlap import check_disjoint

    ins, outs = flying.renamed(inputs, option="--inputs"), flying.renamed(outputs, option="--outputs")
    refs, limits = flying.names(references), flying.band(band)
    lengths = None if windows is None else options.numbers(windows, option="--windows")
    if lengths is not None and not all(0.0 < length < float("inf") for length in lengths):
        raise SwashError(f"'{windows}' are not all positive lengths in s.", channel="--windows")
    with progress(quiet=quiet or json) as line:
        line.say("reading logs")
        raw = read_all(log, how=asked(mapping, unit, drop_bad_stamps, as_logged))
        flights = sp.uniform_records(raw, (*ins, *outs, *refs), rate=rate, cutoff=cutoff, names=ins | outs)
        check_disjoint(flights, log)
        with folder_when_complete(out, ours=FILES) as folder:
            line.say("computing responses")
            responses = sp.respond(
                flights,
                inputs=list(ins),
                outputs=list(outs),
                references=refs,
                band=limits,
                windows=lengths,
                direct=direct,
            )
            document = {**responses.as_dict(), "handling": [one.as_dict() for one in sp.handling_qualities(responses)]}
            if folder is not None:
                line.say("writing the report")
                responses.save(folder / flying.RESPONSES)
                write_json(folder / "responses.json", document)
                sp.report(responses, path=folder / "report.html")
    if json:
        typer.echo(as_json(document))
    elif not quiet:
        typer.echo(repr(responses))
        if out is not None:
            typer.echo(f"\n{told(out, FILES)}")
    flying.end_with(responses.problems)
