"""`swash maneuver`: an excitation to fly, as a table and as ArduPilot's parameters, with its design rules checked."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from swashplate.cli import options
from swashplate.errors import ManeuverError, SwashError

if TYPE_CHECKING:
    from swashplate.flights.maneuvers.ardupilot_chirp import Chirp
    from swashplate.flights.maneuvers.series import Maneuver


def maneuver(
    spec: Annotated[
        str,
        typer.Argument(metavar="SPEC", help='For example "sweep:pitch,0.5-8Hz,60s,0.1" or "doublet:roll,0.5s,0.2".'),
    ],
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="FILE", help="The series as .csv; without it the rules are checked only."),
    ] = None,
    rate: Annotated[
        float, typer.Option("--rate", help="Of the series and of the log [Hz].", min=1.0, max=10000.0)
    ] = 100.0,
    noise: Annotated[
        float | None, typer.Option("--noise", help="Standard deviation of the output's noise, in its unit.", min=0.0)
    ] = None,
    gain: Annotated[
        float | None, typer.Option("--gain", help="Output over input where it is weakest in the band.", min=0.0)
    ] = None,
    coherence: Annotated[float, typer.Option("--coherence", help="Wanted everywhere in the band.")] = 0.8,
    bandwidth: Annotated[
        float | None, typer.Option("--bandwidth", help="Of the response, or of the mode of interest [Hz].")
    ] = None,
    f180: Annotated[
        float | None, typer.Option("--f180", help="Frequency at which the response's phase is -180 deg [Hz].")
    ] = None,
    ardupilot: Annotated[
        bool, typer.Option("--ardupilot", help="A sweep on ArduPilot's schedule, and FILE.param with SID_ parameters.")
    ] = False,
    sid_axis: Annotated[
        int | None,
        typer.Option("--sid-axis", help="ArduPilot's SID_AXIS; without it the mixer, behind the rate controller."),
    ] = None,
    json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Design an excitation: check the rules, and write the series for an autopilot to fly."""
    from swashplate.atomic import write_text
    from swashplate.cli.console import as_json, console
    from swashplate.cli.tables import table
    from swashplate.flights.csv_export import as_csv
    from swashplate.flights.maneuvers.maneuver_design import ExpectedResponse, checks, sampled
    from swashplate.flights.maneuvers.series import parse

    if out is not None and out.suffix.lower() != ".csv":
        raise SwashError(f"ends in '{out.suffix}', expected .csv.", where=out, channel="--out")
    if (noise is None) != (gain is None):
        raise SwashError("only one of --noise and --gain is given.", hint="The amplitude's check needs both.")
    if sid_axis is not None and not ardupilot:
        raise SwashError("is given without --ardupilot.", channel="--sid-axis", hint="Add --ardupilot.")
    planned = parse(spec)
    chirp = _chirp(planned, sid_axis) if ardupilot else None
    known = ExpectedResponse(noise, gain, coherence, bandwidth, f180)
    found = checks(planned, rate=rate, vehicle=known, chirp=chirp)
    written: list[Path] = []
    if out is not None:
        written.append(write_text(out, as_csv(sampled(planned, rate=rate, chirp=chirp))))
        if chirp is not None:
            written.append(write_text(out.with_suffix(".param"), chirp.parameter_file()))
    if json:
        document = {
            "maneuver": vars(planned),
            "checks": [vars(check) for check in found],
            "ardupilot": chirp.parameters() if chirp is not None else None,
            "written": [str(path) for path in written],
        }
        typer.echo(as_json(document))
    elif not quiet:
        rows = [(c.rule, c.found, c.expected, "yes" if c.met else "NO") for c in found]
        console().print(table(("rule", "found", "expected", "met"), rows, left=4))
        if chirp is not None:
            typer.echo("\n" + chirp.parameter_file().rstrip())
        if written:
            typer.echo(f"\nWritten: {', '.join(map(str, written))}")


def _chirp(planned: Maneuver, axis: int | None) -> Chirp:
    """The chirp that ArduPilot flies in place of a sweep."""
    from swashplate.flights.maneuvers.ardupilot_chirp import AXES, MIXER, Chirp
    from swashplate.flights.maneuvers.series import FADE

    if planned.kind != "sweep" or planned.band is None:
        raise ManeuverError(
            f"ArduPilot's System ID mode flies sweeps only, not a {planned.kind}.",
            channel="--ardupilot",
            hint="Fly it from a companion computer, or by hand.",
        )
    number = MIXER.get(planned.axes[0]) if axis is None else axis
    if number is None or number not in AXES:
        raise ManeuverError(
            f"'{planned.axes[0]}' has no SID_AXIS." if axis is None else f"{axis} is no SID_AXIS.",
            channel="--sid-axis",
            hint="; ".join(f"{n} {name} [{unit}]" for n, (name, unit) in AXES.items()) + ".",
        )
    name, unit = AXES[number]
    mixer = MIXER.get(planned.axes[0])
    if mixer is not None and number <= max(MIXER.values()) and name.split()[0] != AXES[mixer][0].split()[0]:
        raise ManeuverError(f"{number} is the {name}, and the sweep is one of {planned.axes[0]}.", channel="--sid-axis")
    if unit == "1" and planned.amplitude > 1.0:
        raise ManeuverError(
            f"an amplitude of {planned.amplitude:g} is beyond the mixer's range of one.",
            channel="--ardupilot",
            hint="Give the mixer's share, for example 0.1; in deg/s with --sid-axis 7, 8 or 9.",
        )
    return Chirp.planned(number, planned.amplitude, planned.band, record=planned.duration, fade=FADE * planned.duration)
