"""`--monte-carlo` of `swash simulate`: the options of many flights."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import typer

from swashplate.cli import options
from swashplate.cli.gusts import turbulence
from swashplate.cli.limits import limits
from swashplate.errors import SwashError


@dataclass(frozen=True)
class Many:
    """Many flights, as the options ask for them; `count` is None for one flight."""

    count: int | None
    options: dict[str, Any]
    given: tuple[str, ...]
    page: Path | None = None


def many(
    monte_carlo: Annotated[
        int | None,
        typer.Option("--monte-carlo", help="Number of flights with sensor noise; --out gets the worst flight.", min=2),
    ] = None,
    fit: Annotated[
        Path | None, typer.Option("--fit", metavar="FILE", help="With --monte-carlo: models drawn from this fit.json.")
    ] = None,
    gusts: Annotated[
        str,
        typer.Option("--gusts", help="With --monte-carlo: none, indoor, indoor=SIGMA, or a mean wind outdoors [m/s]."),
    ] = "none",
    battery: Annotated[
        str | None,
        typer.Option("--battery", metavar="FROM-TO", help="With --monte-carlo: voltage at start and end, 12.5-10.5."),
    ] = None,
    tolerances: Annotated[
        bool, typer.Option("--tolerances", help="With --monte-carlo: the card's numbers drawn from their sigmas.")
    ] = False,
    vary: Annotated[
        list[str] | None,
        typer.Option(
            "--vary", metavar="NAME=SIGMA", help="With --monte-carlo: a number of the card, also NAME=5%; repeatable."
        ),
    ] = None,
    payload: Annotated[
        float, typer.Option("--payload", help="With --monte-carlo: largest added mass [kg].", min=0.0)
    ] = 0.0,
    delay: Annotated[
        float,
        typer.Option("--delay", help="With --monte-carlo: largest added delay of commands [s].", min=0.0, max=1.0),
    ] = 0.0,
    command_bits: Annotated[
        int | None,
        typer.Option("--command-bits", help="With --monte-carlo: number of bits of each command.", min=4, max=24),
    ] = None,
    limit: Annotated[
        list[str] | None,
        typer.Option(
            "--limit",
            metavar="NAME=VALUE",
            help="With --monte-carlo: limit beyond which a flight counts as lost: lean=45deg, rate=360deg/s, "
            "place=2m, height=1m,"
            "heading=45deg, or NAME=none; repeatable.",
        ),
    ] = None,
    report: Annotated[
        Path | None,
        typer.Option("--report", metavar="FILE.html", help="With --monte-carlo: distribution and worst flight."),
    ] = None,
) -> Many:
    """The options as what `sp.monte_carlo` takes."""
    scatter = {
        "--fit": fit,
        "--gusts": gusts != "none",
        "--battery": battery,
        "--tolerances": tolerances,
        "--vary": vary,
        "--payload": payload,
        "--delay": delay,
        "--command-bits": command_bits,
        "--limit": limit,
        "--report": report,
    }
    given = tuple(name for name, wanted in scatter.items() if wanted)
    if monte_carlo is None and given:
        raise SwashError("is for --monte-carlo.", channel=", ".join(given), hint="Add --monte-carlo 100.")
    if report is not None and report.suffix != ".html":
        raise SwashError(f"ends in '{report.suffix}', expected .html.", where=report, channel="--report")
    if monte_carlo is None:
        return Many(None, {}, ())
    chosen: dict[str, Any] = {"fit": fit, "gusts": turbulence(gusts), "battery": _battery(battery)}
    varied = options.assignments(vary, option="--vary")
    for text in varied.values():
        options.numbers(text.removesuffix("%"), option="--vary", count=1)
    chosen |= {"tolerances": tolerances, "vary": varied, "payload": payload, "delay": delay, "bits": command_bits}
    chosen |= {"limits": limits(limit)}
    return Many(monte_carlo, chosen, given, report)


def _battery(text: str | None) -> tuple[float, float] | None:
    if text is None:
        return None
    try:
        ends = options.numbers(text.replace("-", ","), option="--battery", count=2)
    except SwashError:
        raise SwashError(
            f"is '{text}', expected the voltages at start and end.", channel="--battery", hint="Example: 12.5-10.5"
        ) from None
    return ends[0], ends[1]
