"""`swash rotor-speed`: rotor speed from the vibration in a log."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

import typer

from swashplate.cli import options
from swashplate.errors import SwashError

_LINE = re.compile(r"(?P<name>[a-z]\w*)=(?P<low>[-+]?[\d.]+)\.\.(?P<high>[-+]?[\d.]+)")


def rotor_speed(
    flight: options.FlightName,
    line: Annotated[
        list[str] | None,
        typer.Option(
            "--line",
            help="CHANNEL=LOW..HIGH: where a rotor's line lies [Hz]; positive turns clockwise from above, negative "
            "counter-clockwise. The strongest line, as omega_rotor, if not given.",
        ),
    ] = None,
    per_turn: Annotated[
        float, typer.Option("--per-turn", help="Number of vibrations per turn that cause the line.")
    ] = 1.0,
    out: Annotated[Path | None, typer.Option("--out", "-o", help="Write the flight with the speeds (netCDF).")] = None,
    mapping: options.Mapping = None,
    unit: options.Units = None,
    drop_bad_stamps: options.BadStamps = False,
    json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Tell the rotor speed: as the log has it, else from the vibration that a rotor leaves in gyros, accelerometers or
    motion capture.

    Refused where the sampling may have folded the line, where two lines cross, and for an aircraft without a main
    rotor.
    """
    from swashplate.cli.console import as_json
    from swashplate.cli.reading import asked, read
    from swashplate.flights.rotor_speed import rotor_speed as measure

    bands = {}
    for text in line or ():
        match = _LINE.fullmatch(text)
        try:
            bands[match["name"]] = (float(match["low"]), float(match["high"]))  # pyrefly: ignore[unsupported-operation]
        except (TypeError, ValueError):
            raise SwashError(
                f"'{text}' is no line.", channel="--line", hint="For example --line omega_upper=-40..-30."
            ) from None
    how = asked(mapping, unit, drop_bad_stamps)
    measured = measure(read(flight, how=how), lines=bands or None, per_turn=per_turn)
    if out is not None:
        measured.save(out)
    lines = measured.history[-1].details["lines"]
    if json:
        typer.echo(as_json(lines))
    elif not quiet:
        for name, told in lines.items():
            start, stop = told["runs"]
            if told.get("logged"):
                typer.echo(
                    f"{name}: {told['mean']:.4g} rad/s on average, spread {told['spread']:.2g}, from {start:.1f} to "
                    f"{stop:.1f} s, as the log has it. Vibration was not asked; --line asks it."
                )
                _remark(told)
                continue
            folded = " or ".join(f"{hertz:+.1f}" for hertz in told["folded_from_hertz"])
            typer.echo(
                f"{name}: {told['mean']:.1f} ± {told['sigma_of_mean']:.2g} rad/s on average, spread "
                f"{told['spread']:.2g}, from {start:.1f} to {stop:.1f} s; line at {told['hertz']:+.2f} Hz in "
                f"{', '.join(told['signals'])}, {told['decibel']:.0f} dB over its surroundings. A line at {folded} Hz "
                "would look the same."
            )
            _remark(told)


def _remark(told: Mapping[str, Any]) -> None:
    for words in told["remarks"]:
        typer.echo(f"! {words}.")
