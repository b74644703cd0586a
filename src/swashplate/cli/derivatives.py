"""`swash derivatives`: stability and control derivatives of a single-rotor helicopter, by contributor."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from swashplate.cli import conditions as given
from swashplate.cli import options
from swashplate.errors import SwashError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from swashplate.simulation.trim import Trim
    from swashplate.simulation.uncertainty import CardSpread


@given.flown
def derivatives(
    asked: given.Conditions,
    imperial: Annotated[bool, typer.Option("--imperial", help="In feet, as Bhandari et al. have them.")] = False,
    primed: Annotated[
        bool,
        typer.Option("--primed", help="Roll and yaw rows mixed by the product of inertia, as most published tables."),
    ] = False,
    published: Annotated[
        Path | None,
        typer.Option(
            "--published", metavar="FILE.csv", help="Beside a report's: name,value[,unit], or A and B as a matrix."
        ),
    ] = None,
    uncertainty: Annotated[
        bool, typer.Option("--uncertainty", help="Also 5 % and 95 % bounds from the tolerances on the card.")
    ] = False,
    draws: Annotated[int, typer.Option("--draws", help="Samples of the card for that.", min=10, max=100_000)] = 200,
    seed: Annotated[int, typer.Option("--seed", help="Of the samples.", min=0)] = 0,
    left_out: Annotated[
        bool,
        typer.Option("--left-out", help="Instead: what leaving out each one changes, those that matter least first."),
    ] = False,
    plot: given.Page = None,
    json: options.Json = False,
) -> None:
    """Stability and control derivatives: force per mass and moment per inertia, split by what contributes to them."""
    from swashplate.cli.console import as_json, console
    from swashplate.cli.tables import table as tabulate
    from swashplate.simulation.derivatives import derivative_table
    from swashplate.simulation.derivatives_over_speed import derivatives as study

    if uncertainty and len(asked.speeds) > 1:
        raise SwashError("takes one speed.", channel="--uncertainty", hint="Give --speed a single number.")
    if uncertainty and primed:
        raise SwashError("has no bounds.", channel="--primed", hint="Leave out --uncertainty or --primed.")
    if published is not None and (uncertainty or plot is not None or imperial or len(asked.speeds) > 1):
        raise SwashError(
            "takes one speed, and no --uncertainty, --plot or --imperial.",
            channel="--published",
            hint="Units are in the file.",
        )
    if left_out and (uncertainty or primed or imperial or plot or published):
        raise SwashError("goes with --json and the conditions only.", channel="--left-out")
    curve = asked.curve()
    remarks = asked.tell(curve)
    if published is not None:
        from swashplate.cli.published import compare

        compare(asked, curve.trims[0], published, primed=primed, json=json)
        return
    if left_out:
        derivative_table(asked.vehicle, curve.trims[0])  # refuses what has none
        _left_out(asked, curve.trims, json=json, remarks=remarks)
        return
    found = study(
        asked.vehicle,
        curve.trims,
        primed=primed,
        imperial=imperial,
        uncertainty=uncertainty,
        draws=draws,
        seed=seed,
    )
    if plot is not None:
        from swashplate.reporting.speed_page import speed_page

        speed_page(asked.vehicle, found.trims, path=plot, tables=found.tables, remarks=remarks, imperial=imperial)
    if json:
        typer.echo(as_json({"vehicle": asked.name, **found.as_dict(), "remarks": remarks}))
        return
    for at, table in zip(found.trims, found.tables, strict=True):
        typer.echo(f"At {at.speed:g} m/s (flapping follows the motion without delay)")
        console().print(tabulate(*found.rows(table), left=2))
    if (wide := found.bounds) is not None:
        typer.echo(f"\n5 % and 95 % bounds of {wide.draws} samples of the card ({wide.refused} could not be trimmed).")
        _modes(wide)
    if plot is not None:
        typer.echo(f"Written: {plot}")


def _left_out(asked: given.Conditions, found: Sequence[Trim], *, json: bool, remarks: Sequence[str]) -> None:
    """The study behind the paper's remark that X_r may be excluded."""
    from swashplate.cli.console import as_json, console
    from swashplate.cli.tables import table as tabulate
    from swashplate.simulation.linearize import linearize
    from swashplate.simulation.reduction import omissions, paper_model

    studies = [(at.speed, omissions(paper_model(linearize(asked.vehicle, at)))) for at in found]
    if json:
        document = [{"speed": speed, "left_out": [vars(each) for each in study]} for speed, study in studies]
        typer.echo(as_json({"vehicle": asked.name, "studies": document, "remarks": remarks}))
        return
    for speed, study in studies:
        typer.echo(f"At {speed:g} m/s: largest relative change of a mode, and of q/B1, p/A1, r/theta0T, w/theta0")
        rows = [(each.derivative, f"{each.value:.3g}", f"{each.modes:.1e}", f"{each.response:.1e}") for each in study]
        console().print(tabulate(("left out", "value", "modes", "responses"), rows))


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
