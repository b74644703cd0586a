"""`swash derivatives`: stability and control derivatives of a single-rotor helicopter, by contributor."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from swashplate.cli import conditions as given
from swashplate.cli import options
from swashplate.errors import SwashError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from swashplate.simulation.trim import Trim
    from swashplate.vehicles.derivatives import DerivativeTable


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
    from swashplate.simulation.derivatives import derivative_table
    from swashplate.simulation.uncertainty import spread
    from swashplate.vehicles.derivatives import factor_to_feet, split_name, unit

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
    found = asked.trims()
    remarks = asked.doubts(found)
    if published is not None:
        from swashplate.cli.published import compare

        compare(asked, found[0], published, primed=primed, json=json)
        return
    if left_out:
        derivative_table(asked.vehicle, found[0])  # refuses what has none
        _left_out(asked, found, json=json, remarks=remarks)
        return
    tables = [derivative_table(asked.vehicle, at) for at in found]
    if primed:
        card = asked.vehicle.card.values()
        tables = [t.primed(**{name: card[name] for name in ("inertia_xx", "inertia_zz", "inertia_xz")}) for t in tables]
    wide = spread(asked.vehicle, found[0], draws=draws, seed=seed) if uncertainty else None
    if plot is not None:
        from swashplate.reporting.speed_page import speed_page

        speed_page(asked.vehicle, found, path=plot, tables=tables, remarks=remarks, imperial=imperial)
    factors = {name: factor_to_feet(*split_name(name)) if imperial else 1.0 for name in tables[0].names()}
    if json:
        document = [
            {
                "speed": at.speed,
                **({} if wide is None else {"modes": _mode_bounds(wide), "draws": wide.draws, "refused": wide.refused}),
                "derivatives": {
                    name: {
                        "value": table[name] * factors[name],
                        "unit": unit(name, imperial=imperial),
                        "by": {part: value * factors[name] for part, value in _parts(table, name).items()},
                        **({"5 %": low, "95 %": high} if (low := _bound(wide, name, 1)) is not None else {}),
                    }
                    for name in table.names()
                    for high in (_bound(wide, name, 2),)
                },
            }
            for at, table in zip(found, tables, strict=True)
        ]
        typer.echo(as_json({"vehicle": asked.name, "tables": document, "remarks": remarks}))
        return
    for at, table in zip(found, tables, strict=True):
        typer.echo(f"At {at.speed:g} m/s (flapping follows the motion without delay)")
        console().print(_shown(table, factors, imperial=imperial, wide=wide))
    if wide is not None:
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


def _parts(table: DerivativeTable, name: str) -> dict[str, float]:
    from swashplate.vehicles.derivatives import split_name

    row, column = split_name(name)
    return {part: float(block[row, column]) for part, block in table.parts.items()}


def _bound(wide: Any, name: str, place: int) -> float | None:
    return None if wide is None else float(wide.derivatives[name][place])


def _shown(table: DerivativeTable, factors: dict[str, float], *, imperial: bool, wide: Any) -> Any:
    from swashplate.cli.tables import table as tabulate
    from swashplate.vehicles.derivatives import unit

    head = ["derivative", "unit", "total", *(part.replace("_", " ") for part in table.parts)]
    if wide is not None:
        head += ["5 %", "95 %"]
    rows = []
    for name in table.names():
        total = table[name] * factors[name]
        if abs(total) < 1e-9:
            continue
        row = [name, unit(name, imperial=imperial), f"{total:.4g}"]
        for value in _parts(table, name).values():
            row.append(f"{value * factors[name]:.3g}" if abs(value) > 1e-9 else "-")
        if wide is not None:
            row += [f"{wide.derivatives[name][place] * factors[name]:.4g}" for place in (1, 2)]
        rows.append(row)
    return tabulate(head, rows, left=2)


def _mode_bounds(wide: Any) -> list[dict[str, Any]]:
    """Every mode of the card with the 5 % and 95 % quantiles of the samples' [1/s], fastest first."""
    import numpy as np

    found = []
    for i in np.argsort(-np.abs(wide.eigenvalues), kind="stable"):
        value, drawn = wide.eigenvalues[i], wide.samples[:, i]
        if value.imag < 0.0 or abs(value) < 1e-6:
            continue
        real, imag = np.quantile(drawn.real, [0.05, 0.95]), np.quantile(np.abs(drawn.imag), [0.05, 0.95])
        found.append(
            {
                "real": {"value": value.real, "5 %": real[0], "95 %": real[1]},
                "imag": {"value": value.imag, "5 %": imag[0], "95 %": imag[1]},
            }
        )
    return found


def _modes(wide: Any) -> None:
    from swashplate.cli.console import console
    from swashplate.cli.tables import table as tabulate

    rows = []
    for mode in _mode_bounds(wide):
        real, imag = mode["real"], mode["imag"]
        shown = f"{real['value']:+.3f}" + (f" +/- {imag['value']:.3f}j" if imag["value"] else "")
        bounds = (f"{real['5 %']:+.3f} .. {real['95 %']:+.3f}", f"{imag['5 %']:.3f} .. {imag['95 %']:.3f}")
        rows.append((shown, *bounds))
    console().print(tabulate(("mode [1/s]", "real part", "imaginary part"), rows))
