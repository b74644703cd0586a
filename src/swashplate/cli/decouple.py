"""`swash decouple`: from a card, published or identified, to a controller file."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from swashplate.cli import controller_options as shared
from swashplate.cli import options
from swashplate.errors import SwashError

if TYPE_CHECKING:
    from swashplate.control.laws.decoupling import Lag

_LAG = "Phase lag that makes the model's step straight (straight; by default in mode manual), the rotor's from the battery-compensated motor command (battery), the plain one (motor) or the hover's speed (hover), or a constant in degrees."  # fmt: skip # noqa: E501
_STEP = "Fly this step of the pitch command for 6 m, with and without the decoupling."
_DRIFT = "Drift that a flown step with this law had [m to the right after 6 m]; the new law corrects it."
_GUSTS = "With a step: fly drawn models, or without --fit this one, in gusts: none, indoor, indoor=SIGMA, or a mean wind outdoors [m/s]."  # fmt: skip # noqa: E501


def decouple(
    model: Annotated[str, typer.Argument(metavar="MODEL", help="A model file, or a vehicle's name.")],
    out: shared.Out = None,
    lag: Annotated[str | None, typer.Option("--lag", help=_LAG)] = None,
    mixing: Annotated[
        shared.Mixing | None,
        typer.Option("--mixing", help="Form of the equations to invert; the model's own by default."),
    ] = None,
    speed_terms: Annotated[
        bool, typer.Option("--speed-terms/--no-speed-terms", help="Cancel the effect of speed across the motion.")
    ] = True,
    mode: Annotated[
        shared.AutopilotMode, typer.Option("--mode", help="What the servos hold besides a pilot's commands.")
    ] = shared.AutopilotMode.MANUAL,
    voltage: Annotated[float | None, typer.Option("--voltage", help="Battery voltage of the hover [V].")] = None,
    rate: shared.Rate = 100.0,
    c_code: shared.Code = None,
    precision: shared.CPrecision = shared.Precision.DOUBLE,
    step: Annotated[float | None, typer.Option("--step", help=_STEP, min=0.01, max=1.0)] = None,
    to_speed: Annotated[
        float | None,
        typer.Option("--to-speed", help="The same with the step that reaches this speed [m/s]; the paper's is 1.8."),
    ] = None,
    report: Annotated[
        Path | None,
        typer.Option("--report", metavar="FILE", help="Compare the two paths as HTML; to 1.8 m/s without a --step."),
    ] = None,
    fit: Annotated[
        Path | None,
        typer.Option("--fit", metavar="FILE", help="With a step: also on models drawn from a fit.json."),
    ] = None,
    drift: Annotated[float | None, typer.Option("--drift", help=_DRIFT)] = None,
    gusts: Annotated[str, typer.Option("--gusts", help=_GUSTS)] = "none",
    draws: Annotated[int, typer.Option("--draws", help="Number of drawn models.", min=2)] = 500,
    seed: Annotated[int, typer.Option("--seed", help="Seed of the draws.", min=0)] = 0,
    json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Design the decoupling controller of a coaxial helicopter: height and yaw held, roll and pitch decoupled.

    The law inverts the lower rotor's equations with the model's numbers (Fankhauser et al., eqs 19 to 22).
    """
    shared.check_suffixes((report, ".html", "--report"), (out, ".toml", "--out"), (c_code, ".c", "--c"))
    import swashplate as sp
    from swashplate.api.decouple import PAPERS_SPEED
    from swashplate.cli.console import doing
    from swashplate.cli.gusts import turbulence

    with doing("designing the controller", quiet=quiet or json):
        made = sp.decouple(
            sp.vehicle(model),
            mode=mode.value,
            lag=None if lag is None else _lag(lag),
            mixing=None if mixing is None else mixing.value,
            speed_terms=speed_terms,
            voltage=voltage,
            rate=rate,
            step=step,
            to_speed=PAPERS_SPEED if report is not None and step is None and to_speed is None else to_speed,
            drift=drift,
            fit=fit,
            gusts=turbulence(gusts),
            draws=draws,
            seed=seed,
        )
    code = shared.write(made, out=out, c_code=c_code, precision=precision)
    if report is not None:
        sp.report(made, path=report)
    told = None if code is None else f"C of one step: {code.operations} operations a step, {code.work_bytes} bytes of temporaries"  # fmt: skip # noqa: E501
    shared.show(made, code=told, written=(out, c_code, report), json=json, quiet=quiet)


def _lag(text: str) -> Lag | Literal["straight"] | float:
    """A rule's name, or degrees as radians."""
    from swashplate.control.laws.decoupling import LAGS

    if text == "straight":
        return "straight"
    for name in LAGS:
        if text == name:
            return name
    if text.isalpha():
        raise SwashError(f"is '{text}', expected straight, {', '.join(LAGS)} or a number.", channel="lag")
    degrees = options.numbers(text, option="--lag", count=1)[0]
    if not abs(degrees) <= 180.0:
        raise SwashError(f"is {text} degrees, expected at most 180 either way.", channel="--lag")
    return math.radians(degrees)
