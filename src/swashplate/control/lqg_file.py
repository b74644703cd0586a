"""Linear-quadratic controllers as files: the model's card, the sensors, the gains; enough to fly."""

from __future__ import annotations

import tomllib
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w

from swashplate.atomic import write_text
from swashplate.control import observer
from swashplate.control.lqg import Lqg
from swashplate.control.lqg_law import INTEGRALS, Feedback
from swashplate.control.observer import Numbers, Plan, Unrest
from swashplate.control.sensor_suite import KINDS, Sensor
from swashplate.errors import CardError, ControllerError
from swashplate.physics.environment import Environment
from swashplate.simulation.dynamics import equations_of, parameter_row
from swashplate.simulation.trim import Trim
from swashplate.vehicles.card import parse_card
from swashplate.vehicles.catalogue import from_card
from swashplate.vehicles.vehicle import Vehicle

SCHEMA = 1
TYPE = "lqg"
_SINGLE = ("voltage", "reach", "pace", "place")


def save_lqg(controller: Lqg, path: str | Path) -> None:
    """Write a controller as a TOML file."""
    write_text(path, tomli_w.dumps(lqg_document(controller)))


def lqg_document(controller: Lqg) -> dict[str, Any]:
    """What its file says."""
    plan, f = controller.plan, controller.feedback
    about = controller.start.environment
    return {
        "kind": "controller",
        "schema": SCHEMA,
        "type": TYPE,
        "vehicle": controller.vehicle.name,
        "model": controller.vehicle.card.title,
        "rate": plan.rate,
        "delays": dict(zip(controller.vehicle.input_names, (d / plan.rate for d in plan.delays), strict=True)),
        "air": {"air_density": float(about.air_density), "gravity": float(about.gravity)},
        "sensors": [{"kind": s.kind, "rate": s.rate, "delay": s.delay, "sigma": list(s.sigma)} for s in plan.sensors],
        "unrest": controller.unrest._asdict(),
        **({"steady": np.asarray(controller.numbers.steady).tolist()} if plan.period else {}),
        "feedback": {name: np.asarray(part).tolist() for name, part in f._asdict().items()},
        "card": tomllib.loads(controller.vehicle.card.to_toml()),
    }


def lqg_from(document: dict[str, Any], path: str | Path) -> Lqg:
    """A controller from the document of its file.

    Raises:
        ControllerError: naming the file and the entry that is missing, unknown or of the wrong size.
    """
    if document.get("schema") != SCHEMA:
        raise ControllerError(f"schema {document.get('schema')!r}: expected {SCHEMA}.", where=path)
    try:
        vehicle = from_card(parse_card(tomli_w.dumps(document["card"]), path=str(path)))
    except (KeyError, TypeError, CardError) as error:
        raise ControllerError(f"its model: {error}", where=path, channel="[card]") from None
    try:
        rate = float(document["rate"])
        sensors = tuple(
            Sensor(str(s["kind"]), float(s["rate"]), float(s["delay"]), tuple(float(v) for v in s["sigma"]))
            for s in document["sensors"]
        )
        waits = [float(document["delays"][name]) for name in vehicle.input_names]
        unrest = Unrest(**{name: float(value) for name, value in document["unrest"].items()})
        around = Environment(**{name: float(document["air"][name]) for name in ("air_density", "gravity")})
        steady = np.asarray(document["steady"], dtype=np.float64) if "steady" in document else None
        parts = {name: np.asarray(document["feedback"][name], dtype=np.float64) for name in Feedback._fields}
    except (KeyError, TypeError, ValueError) as error:
        raise ControllerError(f"an entry is missing or no number: {error}.", where=path) from None
    for sensor in sensors:
        if sensor.kind not in KINDS or len(sensor.sigma) != len(sensor.channels):
            raise ControllerError(f"'{sensor.kind}' is no sensor with these sigmas.", where=path, channel="sensors")
    if not rate > 0.0 or not all(np.all(np.isfinite(part)) for part in parts.values()):
        raise ControllerError("holds numbers that are not finite, or no positive rate.", where=path)
    plan = Plan(equations_of(vehicle), sensors, rate, tuple(round(wait * rate) for wait in waits)).checked()
    if steady is not None:
        expected = (len(plan.names), len(plan.channels))
        if steady.ndim != 3 or steady.shape[1:] != expected or not np.all(np.isfinite(steady)):
            raise ControllerError(
                f"has shape {steady.shape}, expected (samples of a cycle, {expected[0]}, {expected[1]}).",
                where=path,
                channel="steady",
            )
        plan = replace(plan, period=len(steady))
    feedback = Feedback(**parts)
    _check_sizes(vehicle, plan, feedback, path)
    around = around._replace(voltage=float(feedback.voltage))
    fade, process = observer.process_noise(plan, unrest)
    numbers = Numbers(parameter_row(vehicle, around), fade, process, observer.measurement_noise(plan), steady)
    start = Trim(
        feedback.states[0],
        feedback.inputs[0],
        vehicle.state_names,
        vehicle.input_names,
        around,
        float(feedback.speeds[0]),
        0.0,
        0.0,
        0.0,
    )
    return Lqg(vehicle, plan, numbers, feedback, start, unrest)


def _check_sizes(vehicle: Vehicle, plan: Plan, f: Feedback, path: str | Path) -> None:
    S, n, m = f.speeds.size, plan.n, plan.inputs
    expected: dict[str, tuple[int, ...]] = dict.fromkeys(_SINGLE, ()) | dict.fromkeys(("battery", "low", "high"), (m,))
    expected |= {"speeds": (S,), "states": (S, n), "inputs": (S, m)}
    expected |= {"gains": (S, m, n + sum(plan.delays) + INTEGRALS)}
    for name, shape in expected.items():
        found = np.shape(getattr(f, name))
        if found != shape or S == 0:
            raise ControllerError(f"has shape {found}, expected {shape}.", where=path, channel=f"feedback.{name}")
