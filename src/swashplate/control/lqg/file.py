"""Linear-quadratic controllers as files: the model's card, the sensors, the gains; enough to fly."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any, Literal

import msgspec
import numpy as np

from swashplate import documents
from swashplate.arrays import Array
from swashplate.control.lqg.controller import Lqg
from swashplate.control.lqg.law import INTEGRALS, Feedback
from swashplate.engine.equations import equations_of, parameter_row
from swashplate.errors import CardError, ControllerError
from swashplate.filtering import observer
from swashplate.filtering.disturbances import Unrest
from swashplate.filtering.observer import Numbers, ObserverPlan
from swashplate.filtering.sensor_suite import KINDS, Sensor
from swashplate.models.card import card_from
from swashplate.models.catalogue import from_card
from swashplate.physics.environment import Environment
from swashplate.simulation.trim import Trim

SCHEMA = 1
_LATEST = 1000
"""Steps by which a reading or an input may be late: each is a state of the observer."""


class SensorEntry(msgspec.Struct, forbid_unknown_fields=True):
    """A sensor; its rate [Hz], delay [s] and noise by channel."""

    kind: str
    rate: float
    delay: float
    sigma: list[float]


class AirEntry(msgspec.Struct, forbid_unknown_fields=True):
    """What it was designed in [kg/m^3, m/s^2]."""

    air_density: float
    gravity: float


UnrestEntry: Any = msgspec.defstruct("UnrestEntry", [(n, float) for n in Unrest._fields], forbid_unknown_fields=True)
_ADDED = {"reach_down": 1.5}
"""Numbers that older files do not have, and what stood for them."""
FeedbackEntry: Any = msgspec.defstruct(
    "FeedbackEntry",
    [*((n, Any) for n in Feedback._fields if n not in _ADDED), *((n, Any, value) for n, value in _ADDED.items())],
    forbid_unknown_fields=True,
)


class LqgFile(msgspec.Struct, forbid_unknown_fields=True):
    """What a file of `swash control design` says; sizes are held against the model afterwards."""

    kind: str
    schema: Literal[1]
    type: str
    vehicle: str
    model: str
    rate: float
    delays: dict[str, float]
    air: AirEntry
    sensors: list[SensorEntry]
    unrest: UnrestEntry
    feedback: FeedbackEntry
    card: dict[str, Any]
    steady: list[list[list[float]]] | None = None


_SINGLE = ("voltage", "reach", "reach_down", "pace", "place")


def lqg_document(controller: Lqg) -> dict[str, Any]:
    """What its file says."""
    plan, f = controller.plan, controller.feedback
    about = controller.start.environment
    return {
        "kind": "controller",
        "schema": SCHEMA,
        "type": controller.type,
        "vehicle": controller.vehicle.name,
        "model": controller.vehicle.card.title,
        "rate": plan.rate,
        "delays": dict(zip(controller.vehicle.input_names, (d / plan.rate for d in plan.delays), strict=True)),
        "air": {"air_density": float(about.air_density), "gravity": float(about.gravity)},
        "sensors": [{"kind": s.kind, "rate": s.rate, "delay": s.delay, "sigma": list(s.sigma)} for s in plan.sensors],
        "unrest": controller.unrest._asdict(),
        **({"steady": np.asarray(controller.numbers.steady).tolist()} if plan.period else {}),
        "feedback": {name: np.asarray(part).tolist() for name, part in f._asdict().items()},
        "card": controller.vehicle.card.to_document(),
    }


def lqg_from(document: dict[str, Any], path: str | Path) -> Lqg:
    """A controller from the document of its file.

    Raises:
        ControllerError: naming the file and the entry that is missing, unknown or of the wrong size.
    """
    read = documents.checked(document, LqgFile, where=path, error=ControllerError)
    try:
        vehicle = from_card(card_from(read.card, path=str(path)))
    except (KeyError, TypeError, CardError) as error:
        raise ControllerError(f"its model: {error}", where=path, channel="[card]") from None
    lacking = sorted(set(vehicle.input_names) - set(read.delays))
    if lacking:
        raise ControllerError("is missing.", where=path, channel=f"delays.{lacking[0]}")
    rate = read.rate
    sensors = tuple(Sensor(s.kind, s.rate, s.delay, tuple(s.sigma)) for s in read.sensors)
    waits = [read.delays[name] for name in vehicle.input_names]
    unrest = Unrest(**msgspec.structs.asdict(read.unrest))
    around = Environment(**msgspec.structs.asdict(read.air))
    steady = None if read.steady is None else _array(read.steady, "steady", path)
    parts = {n: _array(getattr(read.feedback, n), f"feedback.{n}", path) for n in Feedback._fields}
    for sensor in sensors:
        if sensor.kind not in KINDS or len(sensor.sigma) != len(sensor.channels):
            raise ControllerError(f"'{sensor.kind}' is no sensor with these sigmas.", where=path, channel="sensors")
    if not rate > 0.0 or not all(np.all(np.isfinite(part)) for part in parts.values()):
        raise ControllerError("holds numbers that are not finite, or no positive rate.", where=path)
    if not all(s.rate > 1e-6 * rate and 0.0 <= s.delay * rate <= _LATEST for s in sensors):
        raise ControllerError(
            f"a rate is not above zero, or a delay is not within 0 to {_LATEST} steps of the controller.",
            where=path,
            channel="sensors",
        )
    if not all(0.0 <= wait * rate <= _LATEST for wait in waits):
        raise ControllerError(f"is not within 0 to {_LATEST} steps of the controller.", where=path, channel="delays")
    plan = ObserverPlan(equations_of(vehicle), sensors, rate, tuple(round(wait * rate) for wait in waits)).checked()
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
    _check_sizes(plan, feedback, path)
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


def _check_sizes(plan: ObserverPlan, f: Feedback, path: str | Path) -> None:
    S, n, m = f.speeds.size, plan.n, plan.inputs
    expected: dict[str, tuple[int, ...]] = dict.fromkeys(_SINGLE, ())
    expected |= dict.fromkeys(("battery", "low", "high"), (m,))
    expected |= {"speeds": (S,), "states": (S, n), "inputs": (S, m)}
    expected |= {"gains": (S, m, n + sum(plan.delays) + INTEGRALS)}
    for name, shape in expected.items():
        actual = np.shape(getattr(f, name))
        if actual != shape or S == 0:
            raise ControllerError(f"has shape {actual}, expected {shape}.", where=path, channel=f"feedback.{name}")


def _array(value: Any, name: str, path: str | Path) -> Array:
    """Numbers of any shape; msgspec has no word for lists in lists of one size."""
    try:
        return np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError):
        raise ControllerError("is no array of numbers.", where=path, channel=name) from None
