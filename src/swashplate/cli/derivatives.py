"""`swash derivatives`: stability and control derivatives of a single-rotor helicopter, by contributor."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from swashplate.cli import conditions as given
from swashplate.cli import options
from swashplate.errors import SwashError

if TYPE_CHECKING:
    from swashplate.simulation.published import PublishedComparison
    from swashplate.simulation.uncertainty import CardSpread


@given.flown
def derivatives(
    asked: given.Conditions,
    imperial: Annotated[bool, typer.Option("--imperial", help="In feet, as in Bhandari et al.")] = False,
    primed: Annotated[
        bool,
        typer.Option("--primed", help="Roll and yaw rows mixed by the product of inertia, as most published tables."),
    ] = False,
    published: Annotated[
        Path | None,
        typer.Option(
            "--published", metavar="FILE.csv", help="Compare with a report: name,value[,unit], or A and B as a matrix."
        ),
    ] = None,
    uncertainty: Annotated[
        bool,
        typer.Option(
            "--uncertainty", help="Also 5 % and 95 % bounds from the tolerances on the card and what such models miss."
        ),
    ] = False,
    draws: Annotated[
        int, typer.Option("--draws", help="Number of samples of the card for --uncertainty.", min=10, max=100_000)
    ] = 200,
    seed: Annotated[int, typer.Option("--seed", help="Seed of the samples.", min=0)] = 0,
    left_out: Annotated[
        bool,
        typer.Option(
            "--left-out", help="Show instead what changes when each one is left out, the least important first."
        ),
    ] = False,
    plot: given.OutPage = None,
    json: options.Json = False,
) -> None:
    """Stability and control derivatives: force per mass and moment per inertia, split by what contributes to them."""
    from swashplate.cli.console import as_json, console
    from swashplate.cli.tables import table as tabulate

    if published is not None and (uncertainty or plot is not None or imperial or len(asked.speeds) > 1):
        raise SwashError(
            "takes one speed, and no --uncertainty, --plot or --imperial.",
            channel="--published",
            hint="Units are in the file.",
        )
    if left_out and (uncertainty or primed or imperial or plot or published):
        raise SwashError("goes with --json and the conditions only.", channel="--left-out")
    import swashplate as sp

    curve = asked.curve()
    remarks = asked.tell(curve)
    if published is not None:
        _compared(
            asked, sp.compare_derivatives(asked.vehicle, curve.trims[0], published, primed=primed), published, json
        )
        return
    if left_out:
        study = sp.omit_derivatives(asked.vehicle, curve.trims)
        if json:
            typer.echo(as_json({"vehicle": asked.name, "studies": study.as_dict(), "remarks": remarks}))
            return
        for place, speed in enumerate(study.speeds):
            typer.echo(f"At {speed:g} m/s: largest relative change of a mode, and of q/B1, p/A1, r/theta0T, w/theta0")
            console().print(tabulate(*study.rows(place)))
        return
    derivative_tables = sp.derivatives(
        asked.vehicle,
        curve.trims,
        primed=primed,
        imperial=imperial,
        uncertainty=uncertainty,
        draws=draws,
        seed=seed,
    )
    if plot is not None:
        sp.report(derivative_tables, path=plot)
    if json:
        typer.echo(as_json({"vehicle": asked.name, **derivative_tables.as_dict(), "remarks": remarks}))
        return
    for at, table in zip(derivative_tables.trims, derivative_tables.tables, strict=True):
        typer.echo(f"At {at.speed:g} m/s (flapping follows the motion without delay)")
        console().print(tabulate(*derivative_tables.rows(table), left=2))
    if (wide := derivative_tables.bounds) is not None:
        typer.echo(f"\n{wide.words}")
        _modes(wide)
    if plot is not None:
        typer.echo(f"Written: {plot}")


def _compared(asked: given.Conditions, comparison: PublishedComparison, path: Path, json: bool) -> None:
    from swashplate.cli.console import as_json, console
    from swashplate.cli.tables import table as tabulate

    if json:
        told = {"vehicle": asked.name, "speed": asked.speeds[0], "published": str(path)}
        typer.echo(as_json(told | comparison.as_dict()))
        return
    typer.echo(f"At {asked.speeds[0]:g} m/s, published in {path} (small: below 2 % of the largest of its kind)")
    console().print(tabulate(*comparison.rows(), left=2))
    typer.echo("\nMean difference (each at most 100 %), and derivatives within 10 %:")
    console().print(tabulate(*comparison.step_rows()))


def _modes(wide: CardSpread) -> None:
    from swashplate.cli.console import console
    from swashplate.cli.tables import table as tabulate

    rows = []
    for mode in wide.modes():
        real, imag = mode["real"], mode["imag"]
        shown = f"{real['value']:+.3f}" + (f" +/- {imag['value']:.3f}j" if imag["value"] else "")
        bounds = (f"{real['5 %']:+.3f} .. {real['95 %']:+.3f}", f"{imag['5 %']:.3f} .. {imag['95 %']:.3f}")
        rows.append((shown, *bounds))
    console().print(tabulate(("mode [1/s]", "real part", "imaginary part"), rows))
