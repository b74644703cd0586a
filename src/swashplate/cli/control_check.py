"""`swash control check`: margins, handling qualities and steps of a controller on a model, as a report and as JSON."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from swashplate.cli import conditions as given
from swashplate.cli import options
from swashplate.errors import SwashError

if TYPE_CHECKING:
    from swashplate.control.check import ControlCheck

OURS = ("report.html", "check.json")


class Task(StrEnum):
    OTHER = "other"
    TRACKING = "tracking"


class Response(StrEnum):
    AUTO = "auto"
    RATE = "rate"
    ATTITUDE = "attitude"


def check(
    model: Annotated[str, typer.Argument(metavar="MODEL", help="A model file, or a vehicle's name.")],
    controller: Annotated[Path, typer.Option("--controller", metavar="FILE", help="The controller's file.")],
    out: options.OutFolder = None,
    task: Annotated[
        Task, typer.Option("--task", help="Which boundaries of ADS-33E: target tracking, or all other tasks.")
    ] = Task.OTHER,
    response: Annotated[
        Response, typer.Option("--response", help="What a steady command gives: it says which bandwidth counts.")
    ] = Response.AUTO,
    scale: Annotated[
        float | None,
        typer.Option("--scale", help="Times that the vehicle is smaller than a full-size one; 1 scales nothing."),
    ] = None,
    speed: Annotated[float, typer.Option("--speed", help="Speed ahead of the steady flight [m/s].")] = 0.0,
    voltage: Annotated[float | None, typer.Option("--voltage", help="Battery voltage [V].")] = None,
    duration: Annotated[float, typer.Option("--duration", help="Of each step [s].", min=5.0, max=300.0)] = 20.0,
    gusts: Annotated[
        str, typer.Option("--gusts", help="Turbulence to hold against: none, indoor, or Dryden's at a mean wind [m/s].")
    ] = "indoor",
    json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Judge a controller on a model: margins, disturbance rejection, handling qualities, steps, coupling, gusts.

    Exit code 2 where the loop does not stand; what could be found is written and marked.
    """
    if scale is not None and not scale > 0.0:
        raise SwashError(f"is {scale:g}, expected a positive number.", channel="--scale", hint="Full size is 1.")
    import swashplate as sp
    from swashplate.cli.console import as_json
    from swashplate.cli.flying import end_with
    from swashplate.cli.monte_carlo import turbulence
    from swashplate.cli.outputs import folder_when_complete
    from swashplate.cli.simulate import from_file
    from swashplate.control.check import check_controller

    blowing = turbulence(gusts)
    vehicle = given.vehicle_of(model, None, None)
    nominal = vehicle.card.values().get("voltage_nominal")
    trim = sp.trim(vehicle, speed=speed, voltage=nominal if voltage is None else voltage)
    made = from_file(controller)(vehicle, trim)
    with folder_when_complete(out, ours=OURS) as folder:
        found = check_controller(
            vehicle,
            made,
            trim,
            task=task.value,
            command=response.value,
            scale=scale,
            duration=duration,
            gusts=blowing,
        )
        document = as_document(found, controller=controller.name)
        if folder is not None:
            from swashplate.atomic import write_text
            from swashplate.reporting.control_check import control_report

            control_report(found, path=folder / "report.html", title=f"{controller.name} on {vehicle.name}")
            write_text(folder / "check.json", as_json(document) + "\n")
    if json:
        typer.echo(as_json(document))
    elif not quiet:
        _tables(found)
        if out is not None:
            typer.echo(f"\nWritten: {', '.join(str(out / name) for name in OURS)}")
    end_with(found.problems)


def as_document(check: ControlCheck, *, controller: str) -> dict[str, Any]:
    """The check as what becomes JSON."""
    import math
    from dataclasses import asdict

    from swashplate.control.requirements import ATTITUDE_COUPLING, GAIN_MARGIN, PHASE_MARGIN, REJECTION_PEAK

    boundaries = [GAIN_MARGIN, PHASE_MARGIN, REJECTION_PEAK, ATTITUDE_COUPLING]
    boundaries += [check.boundary(a.state) for a in check.attitudes]
    margins = None
    if check.margins is not None:
        t = check.margins.together
        margins = {
            "loops": {
                a.name: {
                    "gain": a.gain,
                    "gain_down": a.gain_down,
                    "phase_deg": math.degrees(a.phase),
                    "crossover": a.crossover,
                    "disc": a.disc.alpha,
                    "sensitivity": a.sensitivity,
                }
                for a in check.margins.axes
            },
            "together": {
                "disc": t.alpha,
                "frequency": t.frequency,
                "gain": t.gain,
                "phase_deg": math.degrees(t.phase),
                "delay": t.phase / t.frequency,
            },
        }
    handling = {}
    for a in check.attitudes:
        h = a.handling
        handling[a.state] = {"command": a.reference, "type": a.kind, "level": a.level, "problem": a.problem} | (
            {
                "bandwidth": h.bandwidth.value,
                "bandwidth_phase": h.bandwidth_phase.value,
                "bandwidth_gain": h.bandwidth_gain.value,
                "omega_180": h.omega_180.value,
                "phase_delay": h.phase_delay.value,
            }
            if h
            else {}
        )
    rejection = ("bandwidth", "peak", "peak_frequency", "level", "peak_level")
    steps = ("rise", "overshoot", "settling", "peak", "quickness", "error")
    return {
        "kind": "control-check",
        "vehicle": check.vehicle.name,
        "model": check.vehicle.card.title,
        "controller": controller,
        "rate": check.rate,
        "froude_scale": check.scale,
        "task": check.task,
        "least_stable_mode": {"real": check.slowest.real, "imaginary": abs(check.slowest.imag)},
        "margins": margins,
        "rejection": {r.state: {name: getattr(r, name) for name in rejection} for r in check.rejections},
        "handling": handling,
        "steps": {
            s.reference: {"state": s.state, "size": s.size} | {name: getattr(s.metrics, name) for name in steps}
            for s in check.steps
        },
        "couplings": {c.name: {"value": c.value, "unit": c.unit, "level": c.level} for c in check.couplings},
        "in_gusts": None if check.in_gusts is None else asdict(check.in_gusts),
        "boundaries": [
            {
                "name": b.name,
                "level1": b.level1,
                "scaled": b.scaled(check.scale)[0],
                "source": b.source,
                "checked": b.checked,
            }
            for b in boundaries
        ],
        "problems": list(check.problems),
        "notes": list(check.notes),
    }


def _tables(check: ControlCheck) -> None:
    import math

    from swashplate.cli.console import console
    from swashplate.cli.tables import table

    def shown(value: float | None, form: str = ".3g") -> str:
        return "-" if value is None or not math.isfinite(value) else format(value, form)

    def level(number: int | None) -> str:
        return "-" if number is None else str(number)

    slowest = check.slowest
    typer.echo(
        f"least stable mode {slowest.real:+.3f} +- {abs(slowest.imag):.2f}j 1/s, Froude scale {check.scale:.3g}\n"
    )
    if check.margins is not None:
        typer.echo(f"{check.margins!r}\n")
    if check.rejections:
        head = ("disturbance on", "bandwidth [rad/s]", "level", "peak [dB]", "level")
        rows = [
            (r.state, shown(r.bandwidth), level(r.level), shown(r.peak, ".1f"), level(r.peak_level))
            for r in check.rejections
        ]
        console().print(table(head, rows))
        typer.echo()
    if check.attitudes:
        head = ("answer of pilot's", "type", "bandwidth [rad/s]", "phase delay [s]", "level")
        handled = []
        for a in check.attitudes:
            values = (a.handling.bandwidth.value, a.handling.phase_delay.value) if a.handling else (None, None)
            handled.append((f"{a.state} of {a.reference}", a.kind, *map(shown, values), level(a.level)))
        console().print(table(head, handled, left=2))
        typer.echo()
    if check.steps:
        head = ("step of", "rise [s]", "overshoot [%]", "settled [s]", "quickness [1/s]")
        stepped = [
            (s.reference, shown(s.metrics.rise), shown(100.0 * s.metrics.overshoot, ".0f"), shown(s.metrics.settling),
             shown(s.metrics.quickness))
            for s in check.steps
        ]  # fmt: skip
        console().print(table(head, stepped))
        typer.echo()
        console().print(
            table(
                ("coupling", "largest over largest", "unit", "level"),
                [(c.name, shown(c.value), c.unit, level(c.level)) for c in check.couplings],
            )
        )
    if (blown := check.in_gusts) is not None:
        held = [
            f"{name} {shown(factor * value)} {unit}"
            for name, value, factor, unit in (
                ("place", blown.place, 1e3, "mm"),
                ("speed", blown.speed, 1.0, "m/s"),
                ("height", blown.height, 1e3, "mm"),
                ("heading", blown.heading, math.degrees(1.0), "deg"),
                ("lean", blown.lean, math.degrees(1.0), "deg"),
            )
            if math.isfinite(value)
        ]
        sigma = max(blown.gusts.sigma)
        typer.echo(f"\nin gusts of {sigma:.2g} m/s, {blown.flights} flights, RMS: {', '.join(held)}")
    for note in check.notes:
        typer.echo(f"\n{note}")
    typer.echo("\nLevels by boundaries that were not checked against the standards' text: provisional.")
