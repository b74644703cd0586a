"""Design of a linear-quadratic controller with an observer: from trims and linear models to an `Lqg`.

The linear model is sampled at the controller's rate with its inputs' delays as states (discrete, not Padé) and the
integrals of four errors; the gain is the discrete regulator's. What the model's bar, flapping and drive trains do is in
it as in the vehicle's equations. Before anything is computed the design asks whether the modes can be held, the errors
seen, and the rate is fast enough; each answer names the mode or direction.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from swashplate.control import observer
from swashplate.control.linear_vehicle import delays_of
from swashplate.control.lqg import Lqg
from swashplate.control.lqg_law import Feedback
from swashplate.control.observer import Numbers, Plan, Unrest
from swashplate.control.optimal import delayed, regulator, sampled
from swashplate.control.sensor_suite import Suite
from swashplate.errors import ControllerError
from swashplate.physics.environment import Environment
from swashplate.simulation.dynamics import equations_of, parameter_row
from swashplate.simulation.linearize import LinearModel, linearize
from swashplate.simulation.speeds import trims_over_speed
from swashplate.simulation.trim import Trim
from swashplate.vehicles.vehicle import Vehicle

Array = NDArray[np.float64]
Holding = Literal["place", "speed"]
HOLDINGS: tuple[Holding, ...] = ("place", "speed")

ALLOWED: Mapping[str, float] = {
    **dict.fromkeys(("x", "y"), 0.3),
    "z": 0.2,
    **dict.fromkeys(("u", "v", "w"), 0.6),
    **dict.fromkeys(("phi", "theta"), 0.2),
    "psi": 0.2,
    **dict.fromkeys(("p", "q", "r"), 0.8),
    **dict.fromkeys(("sum_ahead", "sum_right"), 0.6),
    **dict.fromkeys(("sum_down", "sum_heading"), 0.4),
}
"""Deviations [m, m/s, rad, rad/s, and their integrals] that weigh as much as `EFFORT` of an input's range (Bryson)."""
EFFORT = 0.1
EFFORTS: Mapping[str, float] = dict.fromkeys(("motor_lower", "motor_upper"), 0.04)
"""Inputs with another share: motors are slow, and pushing them hard only heats them."""
SUMS = ("sum_ahead", "sum_right", "sum_down", "sum_heading")
_SAMPLES = 20.0
"""Samples per period that a mode needs which does not decay by itself."""
_DAMPED = 0.3
"""Damping ratio from which a mode is left to itself."""
_PACE, _REACH = 1.0, 1.5


def design(
    vehicle: Vehicle,
    *,
    sensors: Suite = (),
    rate: float = 100.0,
    delays: Mapping[str, float] | float | None = None,
    holding: Holding = "place",
    speeds: Sequence[float] = (0.0,),
    allowed: Mapping[str, float] | None = None,
    effort: Mapping[str, float] | float | None = None,
    Q: Any = None,
    R: Any = None,
    unrest: Unrest | None = None,
    voltage: float | None = None,
    environment: Environment | None = None,
) -> Lqg:
    """An LQR (no sensors: it is fed with the states) or LQG controller with integral action.

    Args:
        vehicle: the model, published or identified.
        sensors: what the observer is told: `sensor_suite.suite("imu@100,mocap@100+10ms")`.
        rate: steps per second [Hz].
        delays: from command to action [s], one for all or by input; rounded up to whole samples. Where not given those
            that were identified with a linear model, otherwise none.
        holding: "place" and heading and height, or "speed" ahead and to the right with these.
        speeds: of the trims that the gains are scheduled over [m/s]; more than one needs holding "speed".
        allowed: deviations by state or integral that weigh as much as the effort (`ALLOWED`).
        effort: share of an input's range, one for all or by input (`EFFORT`, `EFFORTS`).
        Q, R: weights instead of these, per second, over `design_states` and the inputs.
        unrest: what disturbs the vehicle, for the observer; by default what the card's identification learnt.
        voltage, environment: of the trims.

    Raises:
        ControllerError: see the module; TrimError where a speed cannot be flown.
    """
    where = vehicle.card.path or vehicle.name
    if holding not in HOLDINGS:
        raise ControllerError(f"is '{holding}', expected {', '.join(HOLDINGS)}.", channel="holding")
    if holding == "place" and (len(speeds) != 1 or speeds[0] != 0.0):
        raise ControllerError("a place is held in hover only.", channel="speeds", hint="Use holding 'speed'.")
    if list(speeds) != sorted(set(speeds)):
        raise ControllerError(f"are {list(speeds)}, expected ascending ones.", channel="speeds")
    late = _delays(vehicle, delays)
    around = environment or Environment()
    if voltage is not None or "voltage_nominal" in vehicle.parameter_names:
        around = around._replace(voltage=voltage if voltage is not None else vehicle.card.values()["voltage_nominal"])
    trims = trims_over_speed(vehicle, speeds, environment=around)
    plan = Plan(
        equations_of(vehicle), tuple(sensors), float(rate), tuple(int(np.ceil(d * rate - 1e-9)) for d in late)
    ).checked()
    models = [linearize(vehicle, at) for at in trims]
    for model in models:
        require_rate(model, rate, where=where)
    names = design_states(vehicle, plan.delays)
    weights = _weights(vehicle, names, allowed or {}, effort, Q, R, where=where)
    gains = [regulated(model, plan, holding, *weights, where=where) for model in models]
    limits = np.array(vehicle.input_limits)
    feedback = Feedback(
        speeds=np.array(speeds, dtype=np.float64),
        states=np.array([at.state for at in trims]),
        inputs=np.array([at.inputs for at in trims]),
        gains=np.array(gains),
        battery=battery_gain(models[0]),
        voltage=np.array(float(around.voltage)),
        low=limits[:, 0],
        high=limits[:, 1],
        reach=np.array(_REACH),
        pace=np.array(_PACE),
        place=np.array(1.0 if holding == "place" else 0.0),
    )
    chosen = unrest or observer.unrest_of(vehicle.card)
    fade, process = observer.process_noise(plan, chosen)
    numbers = Numbers(parameter_row(vehicle, around), fade, process, observer.measurement_noise(plan))
    return Lqg(vehicle, plan, numbers, feedback, trims[0], chosen)


def design_states(vehicle: Vehicle, delays: Sequence[int]) -> tuple[str, ...]:
    """States that the gains multiply: the vehicle's, late commands, integrals of the four errors."""
    waiting = [
        f"{name} {ago} ago" for name, d in zip(vehicle.input_names, delays, strict=True) for ago in range(1, d + 1)
    ]
    return (*vehicle.state_names, *waiting, *SUMS)


def _delays(vehicle: Vehicle, delays: Mapping[str, float] | float | None) -> list[float]:
    if delays is None:
        delays = delays_of(vehicle)
    if not isinstance(delays, Mapping):
        delays = dict.fromkeys(vehicle.input_names, float(delays))
    unknown = sorted(set(delays) - set(vehicle.input_names))
    if unknown:
        raise ControllerError(
            f"{', '.join(unknown)}: expected {', '.join(vehicle.input_names)}.", channel="delays", where=vehicle.name
        )
    found = [float(delays.get(name, 0.0)) for name in vehicle.input_names]
    if not all(0.0 <= d <= 1.0 for d in found):
        raise ControllerError(f"are {found} s, expected 0 to 1.", channel="delays", where=vehicle.name)
    return found


def _weights(
    vehicle: Vehicle,
    names: tuple[str, ...],
    allowed: Mapping[str, float],
    effort: Mapping[str, float] | float | None,
    Q: Any,
    R: Any,
    *,
    where: str,
) -> tuple[Array, Array]:
    unknown = sorted(set(allowed) - set(names))
    if unknown:
        raise ControllerError(
            f"is not a state: {', '.join(unknown)}; expected {', '.join(names)}.", where=where, channel="allowed"
        )
    if effort is None:
        effort = {}
    elif not isinstance(effort, Mapping):
        effort = dict.fromkeys(vehicle.input_names, effort)
    strange = sorted(set(effort) - set(vehicle.input_names))
    if strange:
        raise ControllerError(
            f"is not an input: {', '.join(strange)}; expected {', '.join(vehicle.input_names)}.",
            where=where,
            channel="effort",
        )
    if any(not value > 0.0 for value in (*allowed.values(), *effort.values())):
        raise ControllerError("must be above zero.", where=where, channel="allowed and effort")
    usual = bryson(vehicle, names, allowed=allowed, effort=effort)
    return usual[0] if Q is None else _square(Q), usual[1] if R is None else _square(R)


def bryson(
    vehicle: Vehicle,
    names: Sequence[str],
    *,
    allowed: Mapping[str, float] | None = None,
    effort: Mapping[str, float] | None = None,
) -> tuple[Array, Array]:
    """Weights of states by name and of inputs: one over the square of what is allowed (Bryson's rule)."""
    deviations, shares = {**ALLOWED, **(allowed or {})}, {**EFFORTS, **(effort or {})}
    Q = np.diag([1.0 / deviations[name] ** 2 if name in deviations else 0.0 for name in names])
    spans = zip(vehicle.input_names, vehicle.input_limits, strict=True)
    return Q, np.diag([1.0 / (shares.get(name, EFFORT) * (high - low)) ** 2 for name, (low, high) in spans])


def _square(weights: Any) -> Array:
    found = np.asarray(weights, dtype=np.float64)
    return np.diag(found) if found.ndim == 1 else found


def regulated(model: LinearModel, plan: Plan, holding: Holding, Q: Array, R: Array, *, where: str) -> Array:
    """The gain over `design_states`; a place that is not held has zeros."""
    F, G, names = design_model(model, plan, holding)
    kept = [i for i, name in enumerate(names) if holding == "place" or name not in ("x", "y")]
    size = len(names)
    for label, W, expected in (("state weights", Q, size), ("input weights", R, G.shape[1])):
        if np.shape(W) != (expected, expected):
            raise ControllerError(
                f"are for {W.shape[0]} of {expected}: {', '.join(names if expected == size else model.inputs)}.",
                where=where,
                channel=label,
            )
    moved = [j for j in range(G.shape[1]) if np.any(G[:, j])]
    inside = np.ix_(kept, kept)
    chosen = [names[i] for i in kept]
    K = np.zeros((G.shape[1], size))
    found = regulator(
        F[inside],
        G[np.ix_(kept, moved)],
        Q[inside] * plan.dt,
        R[np.ix_(moved, moved)] * plan.dt,
        chosen,
        scale=np.array([typical(name) for name in chosen]),
        where=where,
    )
    K[np.ix_(moved, kept)] = found
    return K


def design_model(model: LinearModel, plan: Plan, holding: Holding) -> tuple[Array, Array, tuple[str, ...]]:
    """Sampled model of states, late commands and integrals, with the names of its states."""
    F, G = sampled(model.A, model.B, plan.dt)
    F, G, added = delayed(F, G, plan.delays)
    errors = ("x", "y", "z", "psi") if holding == "place" else ("u", "v", "z", "psi")
    C = np.zeros((4, F.shape[0]))
    for row, name in enumerate(errors):
        C[row, model.states.index(name)] = 1.0
    whole = np.block([[F, np.zeros((F.shape[0], 4))], [plan.dt * C, np.eye(4)]])
    waiting = [f"{model.inputs[j]} {ago} ago" for j, ago in added]
    return whole, np.vstack([G, np.zeros((4, G.shape[1]))]), (*model.states, *waiting, *SUMS)


def typical(name: str) -> float:
    """What counts as one in a state, when directions are compared."""
    inner = {"a1": 0.05, "b1": 0.05, "c": 0.1, "d": 0.1, "omega_lower": 20.0, "omega_upper": 20.0, "omega": 10.0}
    return ALLOWED.get(name, inner.get(name, 0.1))


def battery_gain(model: LinearModel) -> Array:
    """Commands per volt lost that make up for it, by least squares: exact where the voltage acts as the motors do."""
    voltage = model.G[:, model.disturbances.index("voltage")]
    return np.asarray(np.linalg.lstsq(model.B, voltage, rcond=None)[0], dtype=np.float64)


def require_rate(model: LinearModel, rate: float, *, where: str) -> None:
    """Raise `ControllerError` where a mode that does not damp itself is too fast for the rate."""
    for mode in model.modes():
        frequency = mode.frequency / (2.0 * np.pi)
        if mode.damping < _DAMPED and mode.frequency > 0.0 and rate < _SAMPLES * frequency:
            value = mode.eigenvalue
            raise ControllerError(
                f"{rate:g} Hz is too slow for the mode {value.real:+.3g} +- {value.imag:.3g}j 1/s "
                f"({', '.join(name for name, share in mode.states if share > 0.1)}).",
                where=where,
                channel="rate",
                hint=f"Run the controller at {np.ceil(_SAMPLES * frequency):.0f} Hz or more.",
            )


def start_of(vehicle: Vehicle, trim: Trim) -> Trim:
    """The trim itself, if it is one of the vehicle's."""
    if trim.state_names != vehicle.state_names:
        raise ControllerError("the start is a trim of another vehicle.", where=vehicle.name)
    return trim
