"""`swash control decouple`: the axes of any linear model by a matrix and by a filter, and what that reaches."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from swashplate.cli import options
from swashplate.errors import SwashError

_USUAL = (
    (("lateral", "p"), ("longitudinal", "q")),
    (("A1", "p"), ("B1", "q")),
    (("servo_roll", "p"), ("servo_pitch", "q")),
)
_SLOW = ("x", "y", "z", "psi", "u", "v", "w", "phi", "theta")
"""States that a filter of fast axes leaves out of its copy, unless they are what is to be decoupled."""


def decouple(
    model: Annotated[
        str,
        typer.Argument(metavar="MODEL", help="A vehicle's name, its file, or a state-space file of `swash fit-ss`."),
    ],
    pair: Annotated[
        list[str] | None,
        typer.Option(
            "--pair", metavar="INPUT=OUTPUT", help="Which input is to move which output; lateral=p and so on."
        ),
    ] = None,
    frequency: Annotated[
        float, typer.Option("--frequency", help="Where the matrix decouples best [rad/s].", min=1e-3)
    ] = 3.0,
    bandwidth: Annotated[float, typer.Option("--bandwidth", help="Of the filter's axes [rad/s].", min=1e-3)] = 10.0,
    keep: Annotated[
        str | None, typer.Option("--keep", metavar="STATE,...", help="States of the filter's copy; the fast ones.")
    ] = None,
    at: Annotated[str, typer.Option("--at", metavar="W,...", help="Frequencies of the table [rad/s].")] = "1,3,10,20",
    speed: Annotated[float, typer.Option("--speed", help="Of a vehicle's steady flight [m/s].")] = 0.0,
    out: Annotated[Path | None, typer.Option("--out", metavar="FILE", help="Matrix and filter (.json).")] = None,
    report: Annotated[
        Path | None, typer.Option("--report", metavar="FILE", help="The coupling and steps as HTML.")
    ] = None,
    json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Decouple the axes of a linear model: by a constant matrix, and by a filter that copies its fast states.

    The table is the off-axis over the on-axis response against frequency, without, with the matrix, with the filter.
    Exit code 2 where the filter would not come to rest; the matrix is told and written all the same.
    """
    if out is not None and out.suffix != ".json":
        raise SwashError(f"ends in '{out.suffix}', expected .json.", where=out, channel="--out")
    if report is not None and report.suffix != ".html":
        raise SwashError(f"ends in '{report.suffix}', expected .html.", where=report, channel="--report")
    frequencies = options.numbers(at, option="--at")
    if min(frequencies) <= 0.0:
        raise SwashError(f"'{at}' is not all positive.", channel="--at")
    from swashplate.atomic import write_text
    from swashplate.cli.console import as_json, console
    from swashplate.cli.flying import end_with
    from swashplate.cli.tables import table
    from swashplate.control.linear_decoupling import coupling, dynamic_decoupling, static_decoupling

    system = _system(model, speed)
    pairs = tuple(options.assignments(pair, option="--pair").items()) or _usual(system)
    axes: dict[str, Any] = {"inputs": [i for i, _ in pairs], "outputs": [o for _, o in pairs]}
    doubled = sorted({o for o in axes["outputs"] if axes["outputs"].count(o) > 1})
    if doubled:
        raise SwashError(f"gives {', '.join(doubled)} to two inputs.", channel="--pair", hint="Give each output once.")
    kept = [part.strip() for part in keep.split(",")] if keep else None
    kept = kept or [name for name in system.state_labels if name not in _SLOW or name in axes["outputs"]]
    made: dict[str, Any] = {"bare": None, "matrix": static_decoupling(system, frequency=frequency, **axes)}
    problem = None
    try:
        made["filter"] = dynamic_decoupling(system, bandwidth=bandwidth, keep=kept, **axes)
    except SwashError as error:
        problem = str(error)
    reached = {name: coupling(system, frequencies, by=by, **axes) for name, by in made.items()}
    document = {
        "kind": "decoupling",
        "model": model,
        "axes": axes,
        "frequencies": frequencies,
        "matrix": made["matrix"].matrix,
        "filter": _matrices(made["filter"].system, kept) if "filter" in made else {"problem": problem},
        "off_over_on_axis": {
            name: {
                f"{output} of {axes['outputs'][k]}'s axis": ratios[i, k]
                for i, output in enumerate(axes["outputs"])
                for k in range(len(pairs))
                if i != k
            }
            for name, ratios in reached.items()
        },
    }
    if out is not None:
        write_text(out, as_json(document) + "\n")
    if report is not None:
        from swashplate.reporting.linear_decoupling import decoupling_report

        decoupling_report(system, made, name=model, frequency=frequency, problem=problem, path=report, **axes)
    if json:
        typer.echo(as_json(document))
    elif not quiet:
        rows = [
            (f"{axis}, {name}", *(f"{100.0 * value:.1f}" for value in values))
            for name, ratios in document["off_over_on_axis"].items()
            for axis, values in ratios.items()
        ]
        console().print(table(("off-axis over on-axis [%] at [rad/s]", *(f"{w:g}" for w in frequencies)), rows))
        mixing = made["matrix"].matrix
        head = (f"matrix made at {frequency:g} rad/s", *axes["outputs"])
        typer.echo()
        console().print(
            table(head, [(name, *(f"{v:+.4f}" for v in row)) for name, row in zip(axes["inputs"], mixing, strict=True)])
        )
        if written := [str(path) for path in (out, report) if path is not None]:
            typer.echo(f"\nWritten: {', '.join(written)}")
    end_with([] if problem is None else [f"No filter: {problem}"])


def _usual(system: Any) -> tuple[tuple[str, str], ...]:
    """Roll and pitch rate by the inputs that this kind of model has for them."""
    return next((pairs for pairs in _USUAL if all(i in system.input_labels for i, _ in pairs)), _USUAL[0])


def _system(model: str, speed: float) -> Any:
    from swashplate.identification.state_space_file import is_state_space, structure, structure_names

    if model in structure_names() or (Path(model).is_file() and is_state_space(model)):
        return structure(model).to_control()
    import swashplate as sp

    vehicle = sp.vehicle(model)
    nominal = vehicle.card.values().get("voltage_nominal")
    return sp.linearize(vehicle, sp.trim(vehicle, speed=speed, voltage=nominal)).to_control()


def _matrices(system: Any, states: list[str]) -> dict[str, Any]:
    return {"states": states, **{name: getattr(system, name) for name in "ABCD"}}
