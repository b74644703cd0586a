"""`swash control`: linear-quadratic controllers with an observer."""

from __future__ import annotations

from typing import Annotated

import typer

from swashplate.cli import autopilot_gains, control_check, decouple_linear, options
from swashplate.cli import conditions as given
from swashplate.cli import controller_options as shared
from swashplate.cli.lateness import Delay, delays_from

app = typer.Typer(
    help="Model-based controllers with an observer, and gains of autopilots.",
    rich_markup_mode=None,
    no_args_is_help=True,
)
app.command("check", short_help="Margins, handling qualities and steps of a controller.")(control_check.check)
app.command("gains", short_help="Gains of ArduPilot or PX4 for a vehicle, with margins.")(autopilot_gains.gains)
app.command("decouple", short_help="Decouple the axes of any linear model.")(decouple_linear.decouple)


def _weights(text: str | None, option: str) -> list[float] | None:
    return None if text is None else options.numbers(text, option=option)


@app.command("design", short_help="Design an LQG or LQR controller with integral action.")
def design(
    model: shared.Model,
    method: Annotated[
        shared.DesignMethod,
        typer.Option("--method", help="With an observer on sensors (lqg), or with the true states (lqr)."),
    ] = shared.DesignMethod.LQG,
    sensors: shared.Sensors = shared.USUAL_SENSORS,
    holding: Annotated[
        shared.Holding,
        typer.Option("--holding", help="A place, or a speed ahead and to the right; always height and heading."),
    ] = shared.Holding.PLACE,
    speed: given.Speed = "0",
    rate: shared.Rate = 100.0,
    delay: Delay = None,
    computation: Annotated[
        float | None,
        typer.Option(
            "--computation", metavar="MS", help="Time from a reading to its command [ms]; one sample by default."
        ),
    ] = None,
    allow: Annotated[
        list[str] | None,
        typer.Option("--allow", metavar="NAME=VALUE", help="Deviation of a state that weighs as much as the effort."),
    ] = None,
    effort: Annotated[
        list[str] | None,
        typer.Option("--effort", metavar="NAME=SHARE", help="Share of an input's range that weighs the same."),
    ] = None,
    state_weights: Annotated[
        str | None, typer.Option("--state-weights", metavar="Q1,Q2,...", help="Weights of all states instead.")
    ] = None,
    input_weights: Annotated[
        str | None, typer.Option("--input-weights", metavar="R1,R2,...", help="Weights of all inputs instead.")
    ] = None,
    gain: Annotated[
        shared.ObserverGain,
        typer.Option("--gain", help="Gain of the observer: computed in flight, or constant (for a small processor)."),
    ] = shared.ObserverGain.FLYING,
    voltage: shared.Voltage = None,
    switched: given.Switch = None,
    out: shared.Out = None,
    c_code: shared.Code = None,
    precision: shared.CPrecision = shared.Precision.DOUBLE,
    json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Design a linear-quadratic controller with integral action from a model's own trims and linear models.

    Where no --effort is given the loops stay slower than delays, sampling and computation allow: they cross below
    1 / (3 total delay), or just above a mode that must be held. With --holding speed and a range of --speed the gains
    are scheduled over the speed that the observer estimates.
    """
    shared.check_suffixes((out, ".toml", "--out"), (c_code, ".c", "--c"))
    import swashplate as sp
    from swashplate.cli.console import doing

    with doing("designing the controller", quiet=quiet or json):
        made = sp.design_controller(
            given.vehicle_of(model, None, switched),
            method=method.value,
            sensors=sensors,
            holding=holding.value,
            speeds=given.speeds(speed),
            rate=rate,
            delays=delays_from(delay),
            computation=None if computation is None else computation / 1e3,
            allowed=options.numbers_by_name(allow, option="--allow"),
            effort=options.numbers_by_name(effort, option="--effort") or None,
            Q=_weights(state_weights, "--state-weights"),
            R=_weights(input_weights, "--input-weights"),
            gain=gain.value,
            voltage=voltage,
        )
    code = shared.write(made, out=out, c_code=c_code, precision=precision)
    told = None
    if code is not None:
        told = f"C of one step: {code.operations} operations, {code.work_bytes} bytes of temporaries, "
        told += f"{code.memory_bytes} bytes between steps"
    shared.show(made, code=told, written=(out, c_code), json=json, quiet=quiet)
