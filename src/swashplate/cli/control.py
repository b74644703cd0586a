"""`swash control`: linear-quadratic controllers with an observer, and what sensors can see."""

from __future__ import annotations

import math
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from swashplate.cli import conditions as given
from swashplate.cli import control_check, decouple_linear, options
from swashplate.errors import SwashError

if TYPE_CHECKING:
    from swashplate.control.lqg import Lqg
    from swashplate.control.lqg_analysis import Analysis

app = typer.Typer(
    help="Model-based controllers with an observer, and what sensors can see.",
    rich_markup_mode=None,
    no_args_is_help=True,
)
app.command("check", short_help="Margins, handling qualities and steps of a controller.")(control_check.check)
app.command("decouple", short_help="Decouple the axes of any linear model.")(decouple_linear.decouple)

_USUAL = "imu@100,mocap@100+10ms"
Sensors = Annotated[
    str,
    typer.Option(
        "--sensors",
        help="KIND@RATE+DELAYms, separated by commas: imu, gyro, mocap, sonar, pressure, flow (optical), compass.",
    ),
]
Model = Annotated[
    str, typer.Argument(metavar="MODEL", help="A vehicle's name or file, or a state-space file of `swash fit-ss`.")
]
Voltage = Annotated[float | None, typer.Option("--voltage", help="Battery voltage of the trims [V].")]


class Method(StrEnum):
    LQG = "lqg"
    LQR = "lqr"


class Holding(StrEnum):
    PLACE = "place"
    SPEED = "speed"


class Gain(StrEnum):
    FLYING = "flying"
    STEADY = "steady"


class Precision(StrEnum):
    DOUBLE = "double"
    FLOAT = "float"


def _weights(text: str | None, option: str) -> list[float] | None:
    return None if text is None else options.numbers(text, option=option)


def _named(texts: list[str] | None, option: str) -> dict[str, float]:
    found = options.assignments(texts, option=option)
    return {name: options.numbers(value, option=option, count=1)[0] for name, value in found.items()}


def _delays(texts: list[str] | None) -> dict[str, float] | float | None:
    """`--delay 20` for all inputs, or `--delay NAME=20` each; milliseconds to seconds. None where nothing is said."""
    if not texts:
        return None
    plain = len(texts) == 1 and "=" not in texts[0]
    found = {"": options.numbers(texts[0], option="--delay", count=1)[0]} if plain else _named(texts, "--delay")
    for name, value in found.items():
        if not 0.0 <= value <= 1000.0:
            told = f"{name}={value:g}" if name else f"{value:g}"
            raise SwashError(f"is {told} ms, expected 0 to 1000.", channel="--delay")
    return found[""] / 1e3 if plain else {name: value / 1e3 for name, value in found.items()}


@app.command("design", short_help="Design an LQG or LQR controller with integral action.")
def design(
    model: Model,
    method: Annotated[
        Method, typer.Option("--method", help="With an observer on sensors (lqg), or fed with the states (lqr).")
    ] = Method.LQG,
    sensors: Sensors = _USUAL,
    holding: Annotated[
        Holding,
        typer.Option("--holding", help="A place, or a speed ahead and to the right; always height and heading."),
    ] = Holding.PLACE,
    speed: given.Speed = "0",
    rate: Annotated[float, typer.Option("--rate", help="Steps of the controller per second [Hz].", min=1.0)] = 100.0,
    delay: Annotated[
        list[str] | None,
        typer.Option("--delay", metavar="MS", help="From command to action [ms]: one number, or NAME=MS by input."),
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
        Gain,
        typer.Option("--gain", help="Of the observer: found as it flies, or constant (a small processor)."),
    ] = Gain.FLYING,
    voltage: Voltage = None,
    switched: given.Switch = None,
    out: Annotated[Path | None, typer.Option("--out", metavar="FILE", help="Write the controller (.toml).")] = None,
    c_code: Annotated[
        Path | None, typer.Option("--c", metavar="FILE", help="Write one step of it as C99 (needs the extra 'export').")
    ] = None,
    precision: Annotated[Precision, typer.Option("--precision", help="Of the C.")] = Precision.DOUBLE,
    json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Design a linear-quadratic controller with integral action from a model's own trims and linear models.

    With --holding speed and a range of --speed the gains are scheduled over the speed that the observer estimates.
    """
    for path, suffix, option in ((out, ".toml", "--out"), (c_code, ".c", "--c")):
        if path is not None and path.suffix != suffix:
            raise SwashError(f"ends in '{path.suffix}', expected {suffix}.", where=path, channel=option)
    from swashplate.cli.console import as_json
    from swashplate.control.controller_file import save_controller
    from swashplate.control.lqg_analysis import analyse
    from swashplate.control.lqg_design import design as find
    from swashplate.control.sensor_suite import suite
    from swashplate.simulation.compilation import enable_compilation_cache

    enable_compilation_cache()
    vehicle = given.vehicle_of(model, None, switched)
    speeds = given.speeds(speed)
    made = find(
        vehicle,
        sensors=() if method is Method.LQR else suite(sensors),
        rate=rate,
        delays=_delays(delay),
        holding=holding.value,
        speeds=speeds,
        allowed=_named(allow, "--allow"),
        effort=_named(effort, "--effort") or None,
        Q=_weights(state_weights, "--state-weights"),
        R=_weights(input_weights, "--input-weights"),
        voltage=voltage,
    )
    found = [analyse(made, at=i, where=model) for i in range(len(speeds))]
    if gain is Gain.STEADY:
        from dataclasses import replace

        from swashplate.control.steady_observer import steady_sigmas, with_steady_gain

        made = with_steady_gain(made)
        kept = dict(zip(made.plan.names, map(float, steady_sigmas(made)), strict=True))
        found = [replace(each, uncertainty={n: kept[n] for n in each.uncertainty if n in kept}) for each in found]
    code = None
    if c_code is not None:
        from swashplate.export.controller_c import controller_code

        code = controller_code(made, precision=precision.value)
        code.save(c_code)
    if out is not None:
        save_controller(made, out)
    if json:
        typer.echo(as_json(_document(made, found, speeds)))
    elif not quiet:
        _tell(made, found, speeds)
        if code is not None:
            typer.echo(
                f"\nC of one step: {code.operations} operations, {code.work_bytes} bytes of temporaries, "
                f"{code.memory_bytes} bytes between steps"
            )
        written = ", ".join(str(path) for path in (out, c_code) if path is not None)
        if written:
            typer.echo(f"\nWritten: {written}")


def _tell(made: Lqg, found: list[Analysis], speeds: tuple[float, ...]) -> None:
    from swashplate.cli.console import console
    from swashplate.cli.tables import table
    from swashplate.vehicles.linear import NAME as LINEAR

    plan = made.plan
    told = ", ".join(map(str, plan.sensors)) or "the states themselves"
    late = ", ".join(
        f"{name} {1e3 * d / plan.rate:g} ms" for name, d in zip(made.vehicle.input_names, plan.delays, strict=True) if d
    )
    called = made.vehicle.card.title if made.vehicle.name == LINEAR else made.vehicle.name
    typer.echo(f"{'LQG' if plan.sensors else 'LQR'} of {called}, {plan.rate:g} Hz, {plan.n} states")
    if plan.period:
        told += f"; constant gains, a cycle of {plan.period}"
    typer.echo(f"told: {told}\nlate: {late or 'nothing'}")
    for speed, analysis in zip(speeds, found, strict=True):
        mode = analysis.modes[0]
        typer.echo(f"\nAt {speed:g} m/s, least stable mode {mode.real:+.3f} +- {abs(mode.imag):.3f}j 1/s")
        typer.echo(repr(analysis.margins))
    units = dict(zip(made.vehicle.state_names, made.vehicle.state_units, strict=True))
    rows = []
    for name, value in found[0].spread.items():
        factor, unit = (
            (math.degrees(1.0), units[name].replace("rad", "deg")) if "rad" in units[name] else (1.0, units[name])
        )
        known = found[0].uncertainty.get(name)
        rows.append((f"{name} [{unit}]", f"{factor * value:.3g}", "-" if known is None else f"{factor * known:.3g}"))
    typer.echo()
    console().print(table((f"in gusts as assumed, at {speeds[0]:g} m/s", "strays (1 sigma)", "known to"), rows))


def _document(made: Lqg, found: list[Analysis], speeds: tuple[float, ...]) -> dict[str, Any]:
    trims = []
    for speed, analysis in zip(speeds, found, strict=True):
        together = analysis.margins.together
        trims.append(
            {
                "speed": speed,
                "least_stable_mode": {"real": analysis.modes[0].real, "imaginary": abs(analysis.modes[0].imag)},
                "margins": {
                    **{a.name: {"gain": a.gain, "phase_deg": math.degrees(a.phase)} for a in analysis.margins.axes},
                    "together": {
                        "disc": together.alpha,
                        "gain": together.gain,
                        "phase_deg": math.degrees(together.phase),
                    },
                },
                "spread": analysis.spread,
                "uncertainty": analysis.uncertainty,
            }
        )
    return {
        "vehicle": made.vehicle.name,
        "model": made.vehicle.card.title,
        "rate": made.rate,
        "sensors": [str(sensor) for sensor in made.plan.sensors],
        "delays": [d / made.rate for d in made.plan.delays],
        "trims": trims,
    }


@app.command("observability", short_help="What sensors can see of a vehicle, and what they cannot.")
def observability(
    model: Model,
    sensors: Sensors = _USUAL,
    speed: given.Speed = "0",
    seconds: Annotated[float, typer.Option("--seconds", help="How long is watched [s].", min=0.1)] = 10.0,
    rate: Annotated[float, typer.Option("--rate", help="Samples per second of the model [Hz].", min=1.0)] = 100.0,
    voltage: Voltage = None,
    switched: given.Switch = None,
    json: options.Json = False,
) -> None:
    """Say which directions of a vehicle's states a sensor suite cannot see, and how well the others are known."""
    from dataclasses import asdict

    import swashplate as sp
    from swashplate.cli.console import as_json
    from swashplate.control import observability as study
    from swashplate.control.sensor_suite import suite

    vehicle, chosen = given.vehicle_of(model, None, switched), suite(sensors)
    usual = vehicle.card.values().get("voltage_nominal") if voltage is None else voltage
    documents = []
    for at in given.speeds(speed):
        found = study.observability(
            vehicle, sp.trim(vehicle, speed=at, voltage=usual), chosen, rate=rate, seconds=seconds
        )
        hidden, faint = ([study.in_words(d) for d in part] for part in (found.hidden, found.faint))
        documents.append({"speed": at, "hidden": hidden, "faint": faint, "known": [asdict(k) for k in found.known]})
        if not json:
            typer.echo(f"At {at:g} m/s\n{found!r}\n")
    if json:
        typer.echo(as_json({"model": vehicle.card.title, "sensors": [str(s) for s in chosen], "trims": documents}))
