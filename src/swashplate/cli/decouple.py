"""`swash decouple`: from a card, published or identified, to a controller file."""

from __future__ import annotations

import math
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from swashplate.cli import options
from swashplate.errors import SwashError

if TYPE_CHECKING:
    from collections.abc import Mapping

    from swashplate.control.autopilot import Autopilot
    from swashplate.control.observed_autopilot import ObservedAutopilot
    from swashplate.control.straightness import StepRun
    from swashplate.vehicles.vehicle import Vehicle


_PAPERS_SPEED = 1.8  # m/s, Fankhauser et al., Fig. 10
_FURTHEST = 6.0  # m of drift, as far as the step goes


class Mode(StrEnum):
    MANUAL = "manual"
    SPEED = "speed"
    PLACE = "place"


class Mixing(StrEnum):
    ROTATION = "rotation"
    AS_PRINTED = "as_printed"


class Precision(StrEnum):
    DOUBLE = "double"
    FLOAT = "float"


def decouple(
    model: Annotated[str, typer.Argument(metavar="MODEL", help="A model file, or a vehicle's name.")],
    out: Annotated[Path | None, typer.Option("--out", metavar="FILE", help="Write the controller (.toml).")] = None,
    lag: Annotated[
        str,
        typer.Option(
            "--lag",
            help="Phase lag from the battery-compensated motor command (battery), the plain one (motor), the "
            "hover's rotor speed (hover), or a constant in degrees.",
        ),
    ] = "battery",
    mixing: Annotated[
        Mixing | None, typer.Option("--mixing", help="Form of the equations to invert; the model's own by default.")
    ] = None,
    speed_terms: Annotated[
        bool, typer.Option("--speed-terms/--no-speed-terms", help="Cancel what speed does across the motion.")
    ] = True,
    mode: Annotated[
        Mode, typer.Option("--mode", help="What the servos hold besides a pilot's commands.")
    ] = Mode.MANUAL,
    voltage: Annotated[float | None, typer.Option("--voltage", help="Battery voltage of the hover [V].")] = None,
    rate: Annotated[float, typer.Option("--rate", help="Steps of the controller per second [Hz].", min=1.0)] = 100.0,
    c_code: Annotated[
        Path | None, typer.Option("--c", metavar="FILE", help="Write one step of it as C99 (needs the extra 'export').")
    ] = None,
    precision: Annotated[Precision, typer.Option("--precision", help="Of the C.")] = Precision.DOUBLE,
    step: Annotated[
        float | None,
        typer.Option(
            "--step",
            help="Fly this step of the pitch command for 6 m, with and without the decoupling.",
            min=0.01,
            max=1.0,
        ),
    ] = None,
    to_speed: Annotated[
        float | None,
        typer.Option("--to-speed", help="The same with the step that reaches this speed [m/s]; the paper's is 1.8."),
    ] = None,
    report: Annotated[
        Path | None,
        typer.Option("--report", metavar="FILE", help="Compare the two paths as HTML; to 1.8 m/s without a --step."),
    ] = None,
    sensors: Annotated[
        str | None,
        typer.Option("--sensors", help="Fly on estimates from these, e.g. imu@100,mocap@50+20ms, not on measurements."),
    ] = None,
    fit: Annotated[
        Path | None,
        typer.Option("--fit", metavar="FILE", help="With a step: also on models drawn from a fit.json."),
    ] = None,
    drift: Annotated[
        float | None,
        typer.Option("--drift", help="Seen on the step with this law [m to the right after 6 m]: take it out."),
    ] = None,
    draws: Annotated[int, typer.Option("--draws", help="How many of them.", min=2)] = 500,
    seed: Annotated[int, typer.Option("--seed", help="Of the draws.", min=0)] = 0,
    json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Design the decoupling controller of a coaxial helicopter: height and yaw held, roll and pitch decoupled.

    The law inverts the lower rotor's equations with the model's numbers (Fankhauser et al., eqs 19 to 22).
    """
    if step is not None and to_speed is not None:
        raise SwashError("are two steps.", channel="--step and --to-speed", hint="Give one.")
    if to_speed is not None and not to_speed > 0.0:
        raise SwashError(f"is {to_speed:g} m/s, expected a positive speed.", channel="--to-speed")
    if report is not None and report.suffix != ".html":
        raise SwashError(f"ends in '{report.suffix}', expected .html.", where=report, channel="--report")
    if report is not None and step is None and to_speed is None:
        to_speed = _PAPERS_SPEED
    if fit is not None and step is None and to_speed is None:
        raise SwashError("is for the paths of a --step.", channel="--fit", hint="Add --step 0.2.")
    if drift is not None and step is None and to_speed is None:
        raise SwashError("was seen on a step.", channel="--drift", hint="Add that step: --step 0.4 or --to-speed 1.8.")
    if drift is not None and not abs(drift) <= _FURTHEST:
        raise SwashError(f"is {drift:g} m, expected at most {_FURTHEST:g} either way.", channel="--drift")
    if out is not None and out.suffix != ".toml":
        raise SwashError(f"ends in '{out.suffix}', expected .toml.", where=out, channel="--out")
    if c_code is not None and c_code.suffix != ".c":
        raise SwashError(f"ends in '{c_code.suffix}', expected .c.", where=c_code, channel="--c")
    if sensors is not None and (c_code is not None or out is None):
        raise SwashError("goes into the file of --out; the C of --c takes measurements.", channel="--sensors")
    import swashplate as sp
    from swashplate.cli.console import as_json, console
    from swashplate.cli.tables import table
    from swashplate.control.autopilot import autopilot
    from swashplate.control.controller_file import save_controller
    from swashplate.control.decoupling import LAGS, estimated_lag
    from swashplate.control.stability import loop_margins, loop_modes, require_stable

    vehicle = sp.vehicle(model)
    hover = sp.trim(vehicle, voltage=vehicle.card.values().get("voltage_nominal") if voltage is None else voltage)
    named = lag in LAGS or lag.isalpha()
    if not named and not abs(options.numbers(lag, option="--lag", count=1)[0]) <= 180.0:
        raise SwashError(f"is {lag} degrees, expected at most 180 either way.", channel="--lag")
    wanted: Any = lag if named else math.radians(options.numbers(lag, option="--lag", count=1)[0])
    made = autopilot(
        vehicle,
        hover,
        mode=mode.value,
        rate=rate,
        lag=wanted,
        speed_terms=speed_terms,
        mixing=None if mixing is None else mixing.value,
    )
    if to_speed is not None:
        from swashplate.control.straightness import command_for_speed

        step = command_for_speed(vehicle, made, hover, speed=to_speed)
    if drift is not None:
        from swashplate.control.learning import corrected_by_step

        assert step is not None
        made = corrected_by_step(vehicle, made, hover, command=step, drift=drift)
    law, slowest = made.numbers.law, loop_modes(vehicle, made, hover)[0]
    if made.mode != "manual":  # a pilot damps what "manual" leaves alone
        require_stable(slowest, rate=made.rate, where=model)
    margins = None if made.mode == "manual" else loop_margins(vehicle, made, hover)
    volts = float(hover.environment.voltage)
    motor = hover.commands()["motor_lower"]
    degrees = {u: math.degrees(estimated_lag(law, motor, u)) for u in (volts, volts - 1.0)}
    if out is not None:
        save_controller(made if sensors is None else _on_estimates(vehicle, made, sensors, volts), out)
    code = None
    if c_code is not None:
        from swashplate.export.controller_c import controller_code

        code = controller_code(made, precision=precision.value)
        code.save(c_code)
    found: dict[str, Any] = {
        "vehicle": vehicle.name,
        "model": vehicle.card.title,
        "mode": made.mode,
        "rate": made.rate,
        "mixing": "rotation" if law.mixing > 0 else "as_printed",
        "lag_at_hover_deg": degrees[volts],
        "law": law._asdict(),
        "least_stable_mode": {"real": slowest.real, "imaginary": abs(slowest.imag)},
    }
    if margins is not None:
        together = margins.together
        found["margins"] = {
            **{axis.name: {"gain": axis.gain, "phase_deg": math.degrees(axis.phase)} for axis in margins.axes},
            "together": {"disc": together.alpha, "gain": together.gain, "phase_deg": math.degrees(together.phase)},
        }
    flown = {}
    sources: Any = ((), 0.0)
    if step is not None:
        from swashplate.control.learning import drift_sources
        from swashplate.control.robustness import draw_models
        from swashplate.control.straightness import step_run

        bare = autopilot(vehicle, hover, mode="manual", rate=rate, decoupled=False)
        drawn = None if fit is None else draw_models(vehicle, fit, count=draws, seed=seed)
        runs = {
            name: step_run(vehicle, controller, hover, command=step, parameters=drawn)
            for name, controller in (("without", bare), ("with", made))
        }
        flown = _figures(runs, draws)
        if drawn is not None and (spread := runs["with"].drawn) is not None:
            sources = drift_sources(spread.drift, drawn)
        found["step"] = {"command": step, **flown, "drift_sources": dict(sources[0])}
        if report is not None:
            from swashplate.reporting.straightness import straightness_report

            straightness_report(vehicle, runs, command=step, lag=degrees[volts], sources=sources[0], path=report)
    if json:
        typer.echo(as_json(found))
    elif not quiet:
        across = 100.0 * math.sin(math.radians(degrees[volts]))
        rows = [
            ("form of the equations", str(found["mixing"]), ""),
            ("lower rotor at hover", f"{hover.states()['omega_lower']:.1f}", "rad/s"),
            ("phase lag taken out at hover", f"{degrees[volts]:.2f}", "deg"),
            ("  at the same command, 1 V less", f"{degrees[volts - 1.0]:.2f}", "deg"),
            ("of a command goes across without it", f"{across:.0f}", "%"),
            ("roll command against 1 m/s ahead", f"{(law.across_u + law.across_u_linear) / law.linkage:+.3f}", "1"),
            ("pitch command against 1 m/s right", f"{-(law.across_v + law.across_v_linear) / law.linkage:+.3f}", "1"),
            ("least stable mode of the loop", f"{slowest.real:+.3f} +- {abs(slowest.imag):.3f}j", "1/s"),
        ]
        made_table = table((f"decoupling of {vehicle.name}, mode {made.mode}", "", ""), rows)
        made_table.columns[2].justify = "left"
        console().print(made_table)
        if margins is not None:
            typer.echo(f"\n{margins!r}")
        if flown:
            typer.echo(f"\nstep of the pitch command: {step:.3f}")
            head = ("path on the step", "drift at 6 m [m]", "leftmost [m]", "rightmost [m]", "fastest [m/s]", "models")
            cells = [
                (name, *(f"{entry[key]:+.2f}" for key in ("drift", "leftmost", "rightmost", "speed")), entry["models"])
                for name, entry in flown.items()
            ]
            console().print(table(head, cells))
        if sources[0]:
            told = ", ".join(f"{name} {100.0 * share:.0f} %" for name, share in sources[0][:4])
            typer.echo(f"\nof the drift's variance with the law: {told} (a line explains {100.0 * sources[1]:.0f} %)")
        if code is not None:
            told = f"{code.operations} operations a step, {code.work_bytes} bytes of temporaries"
            typer.echo(f"\nC of one step: {told}")
        written = ", ".join(str(path) for path in (out, c_code, report) if path is not None)
        if written:
            typer.echo(f"\nWritten: {written}")


def _on_estimates(vehicle: Vehicle, made: Autopilot, sensors: str, voltage: float) -> ObservedAutopilot:
    from swashplate.control.lqg_design import design
    from swashplate.control.observed_autopilot import ObservedAutopilot
    from swashplate.control.sensor_suite import suite

    return ObservedAutopilot(made, design(vehicle, sensors=suite(sensors), rate=made.rate, voltage=voltage))


def _figures(runs: Mapping[str, StepRun], draws: int) -> dict[str, dict[str, Any]]:
    """Paths on the step: of the model itself, and percentiles over drawn models."""
    import numpy as np

    figures = ("drift", "leftmost", "rightmost", "speed")
    found: dict[str, dict[str, Any]] = {}
    for name, run in runs.items():
        found[name] = {key: float(getattr(run.path, key)[0]) for key in figures} | {"models": "this one"}
        if run.drawn is not None:
            arrived = int(np.sum(np.isfinite(run.drawn.drift)))
            for percent in (5, 50, 95):
                values = {key: float(np.nanpercentile(getattr(run.drawn, key), percent)) for key in figures}
                found[f"{name}, {percent} %"] = values | {"models": f"{arrived} of {draws}"}
    return found
