"""Design of a linear-quadratic controller with an observer: from trims and linear models to an `Lqg`.

The linear model is sampled at the controller's rate with its inputs' delays as states (discrete, not Padé) and the
integrals of four errors; the gain is the discrete regulator's. What the model's bar, flapping and drive trains do is in
it as in the vehicle's equations. Before anything is computed the design asks whether the modes can be held, the errors
seen, and the rate is fast enough; each answer names the mode or direction.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Literal

import numpy as np

from swashplate.arrays import Array
from swashplate.control.analysis.margins import promised_disc
from swashplate.control.lqg.controller import Lqg
from swashplate.control.lqg.law import Feedback
from swashplate.control.lqg.optimal import (
    ALLOWED,
    DISC,
    EFFORT,
    EFFORTS,
    LAG_AT_CROSSOVER,
    PLACE,
    SUMS,
    TIGHTER,
    TIGHTEST,
    bryson,
    checked_weights,
    crossover_limits,
    regulator,
    square,
    total_delays,
    typical,
)
from swashplate.control.lqg.steady_loop import Watched, crossovers
from swashplate.engine.equations import equations_of, parameter_row
from swashplate.errors import ControllerError
from swashplate.filtering import disturbances, observer
from swashplate.filtering.disturbances import Unrest
from swashplate.filtering.observer import Numbers, ObserverPlan
from swashplate.filtering.sensor_suite import Suite
from swashplate.models.surroundings import complete_delays, environment_of, input_delays
from swashplate.models.vehicle import Vehicle
from swashplate.physics.environment import Environment
from swashplate.simulation.discretisation import with_late_inputs, zero_order_hold
from swashplate.simulation.linearize import LinearModel, linearize
from swashplate.simulation.trim_curve import trims_over_speed

Holding = Literal["place", "speed"]
HOLDINGS: tuple[Holding, ...] = ("place", "speed")

_SAMPLES = 20.0
"""Samples per period that a mode needs which does not decay by itself."""
_ROUNDS, _LEAST_CUT, _MOST_CUT, _STUCK, _PATIENCE = 24, 0.25, 0.8, 0.98, 4
"""Of the search for the effort: rounds, bounds of one round's factor, share of a crossover that is no fall, and rounds
without a fall that are tried."""
_NO_HIGHER = 1.02
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
    computation: float | None = None,
) -> Lqg:
    """An LQR (no sensors: it is fed with the states) or LQG controller with integral action.

    Args:
        vehicle: the model, published or identified.
        sensors: what the observer is told: `sensor_suite.suite("imu@100,mocap@100+10ms")`.
        rate: steps per second [Hz].
        delays: from command to action [s], one for all or by input; with the computation rounded up to whole samples.
            Where not given those that were identified and stand in the vehicle's card, otherwise none.
        holding: "place" and heading and height, or "speed" ahead and to the right with these.
        speeds: of the trims that the gains are scheduled over [m/s]; more than one needs holding "speed".
        allowed: deviations by state or integral that weigh as much as the effort (`ALLOWED`).
        effort: share of an input's range, one for all or by input. Where not given `EFFORT` and `EFFORTS`, less where
            the loop at the input would cross above `crossover_limits`; integrals then weigh less too. Where neither
            effort nor a level place is said, the place is held as tightly as the delays let it (`_tightened`).
        Q, R: weights instead of these, per second, over `design_states` and the inputs.
        unrest: what disturbs the vehicle, for the observer; by default what the card's identification learnt.
        voltage, environment: of the trims.
        computation: from a reading's arrival to the command [s], added to the delays; None where it is not known.

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
    delay_by_input = complete_delays(vehicle, input_delays(vehicle) if delays is None else delays)
    if computation is not None and not 0.0 <= computation <= 1.0:
        raise ControllerError(f"is {computation:g} s, expected 0 to 1.", channel="computation")
    waits = [d + (computation or 0.0) for d in delay_by_input.values()]
    around = environment_of(vehicle, environment)
    if voltage is not None:
        around = around._replace(voltage=voltage)
    trims = trims_over_speed(vehicle, speeds, environment=around)
    plan = ObserverPlan(
        equations_of(vehicle), tuple(sensors), float(rate), tuple(int(np.ceil(d * rate - 1e-9)) for d in waits)
    ).checked()
    models = [linearize(vehicle, at) for at in trims]
    for model in models:
        require_rate(model, rate, where=where)
    names = design_states(vehicle, plan.delays)
    chosen = unrest or disturbances.unrest_of(vehicle.card)
    fade, process = observer.process_noise(plan, chosen)
    numbers = Numbers(parameter_row(vehicle, around), fade, process, observer.measurement_noise(plan))
    efforts = checked_weights(vehicle, names, allowed or {}, effort, where=where)

    def designed(shares: Array, tight: float = 1.0) -> list[Array]:
        deviations = {**_eased(shares, tight), **(allowed or {})}
        usual = bryson(vehicle, names, allowed=deviations, effort=_shared(vehicle, efforts, shares))
        weights = usual[0] if Q is None else square(Q), usual[1] if R is None else square(R)
        return [regulated(model, plan, holding, *weights, where=where) for model in models]

    free = [R is None and name not in efforts for name in vehicle.input_names]
    most = np.where(free, crossover_limits(plan, models, computation=computation), np.inf)
    loops = [Watched(plan, numbers, m, place=holding == "place") for m in models]
    gains, shares, tight = *_slowed(designed, most, loops), 1.0
    if holding == "place" and Q is None and all(free) and not set(PLACE) & set(allowed or {}):
        limit = LAG_AT_CROSSOVER / total_delays(plan, computation=computation)
        gains, tight = _tightened(lambda share: designed(shares, share), gains, limit, loops)
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
        reach=np.array(_REACH * tight),
        reach_down=np.array(_REACH),
        pace=np.array(_PACE),
        place=np.array(1.0 if holding == "place" else 0.0),
    )
    limits_of = dict(zip(vehicle.input_names, map(float, most), strict=True))
    return Lqg(vehicle, plan, numbers, feedback, trims[0], chosen, figures={"crossover_limits": limits_of})


def design_states(vehicle: Vehicle, delays: Sequence[int]) -> tuple[str, ...]:
    """States that the gains multiply: the vehicle's, late commands, integrals of the four errors."""
    waiting = [
        f"{name} {ago} ago" for name, d in zip(vehicle.input_names, delays, strict=True) for ago in range(1, d + 1)
    ]
    return (*vehicle.state_names, *waiting, *SUMS)


def _shared(vehicle: Vehicle, efforts: Mapping[str, float], shares: Array) -> dict[str, float]:
    """Effort by input: what was given, and shares of the usual."""
    usual = (share * EFFORTS.get(name, EFFORT) for name, share in zip(vehicle.input_names, shares, strict=True))
    return {**dict(zip(vehicle.input_names, usual, strict=True)), **efforts}


def _eased(shares: Array, tight: float) -> dict[str, float]:
    """What is allowed where nothing is said: integrals by the root of the smallest share, and a tighter place.

    With an effort f times the usual, the poles of a chain of four integrators slow down by the root of f: so does the
    integral action, and stays as far below the loop that carries it.
    """
    eased = {name: ALLOWED[name] / float(np.sqrt(np.min(shares))) for name in SUMS}
    return {**eased, **{name: tight * eased.get(name, ALLOWED[name]) for name in PLACE}}


def _slowed(
    designed: Callable[[Array], list[Array]], most: Array, loops: Sequence[Watched]
) -> tuple[list[Array], Array]:
    """Gains whose loops cross no higher than `most` [rad/s], by less effort; one that no longer slows down stays.

    Args:
        designed: gains of all trims for shares of the usual effort by input.
        most: by input; infinite for what is not to be touched.
        loops: of the trims.

    Returns:
        The gains, and the shares.
    """
    shares, lowest, in_vain = np.ones(len(most)), np.full(len(most), np.inf), np.zeros(len(most))
    gains = designed(shares)
    for _ in range(_ROUNDS):
        if not np.any(np.isfinite(most)):
            break
        loop_crossovers = _highest(loops, gains)
        in_vain = np.where(loop_crossovers > _STUCK * lowest, in_vain + 1, 0)
        lowest = np.minimum(lowest, loop_crossovers)
        above = (loop_crossovers > most) & (in_vain < _PATIENCE)
        if not above.any():
            break
        shares = np.where(above, shares * np.clip(most / loop_crossovers, _LEAST_CUT, _MOST_CUT), shares)
        gains = designed(shares)
    return gains, shares


def _highest(loops: Sequence[Watched], gains: Sequence[Array]) -> Array:
    """Crossover of every loop, the highest of all trims [rad/s]."""
    return np.asarray(
        np.max([crossovers(*loop.sensitivities(gain)) for loop, gain in zip(loops, gains, strict=True)], axis=0)
    )


def _tightened(
    designed: Callable[[float], list[Array]], gains: list[Array], limit: Array, loops: Sequence[Watched]
) -> tuple[list[Array], float]:
    """Gains that hold the place as tightly as the delays let them, and what they allow of it over `ALLOWED`.

    A fixed distance knows nothing of the vehicle: gusts moved a late CoaX half a metre while its loops crossed at half
    of what their delays allow. The place is held more tightly, step by step, while no loop crosses above the limit
    (one that does already, crosses no higher) and all at once keep the disc margin `DISC`.

    Args:
        designed: gains of all trims for a share of what is allowed of the place.
        gains: with all of it.
        limit: crossovers that the delays allow [rad/s], by input.
        loops: of the trims.
    """
    (loop,), share = loops, 1.0
    w, S = loop.sensitivities(gains[0])
    most = np.maximum(limit, _NO_HIGHER * crossovers(w, S))
    while promised_disc(S) >= DISC and share * TIGHTER > TIGHTEST:
        tried = designed(share * TIGHTER)
        w, S = loop.sensitivities(tried[0])
        if promised_disc(S) < DISC or np.any(crossovers(w, S) > most):
            break
        gains, share = tried, share * TIGHTER
    return gains, share


def regulated(model: LinearModel, plan: ObserverPlan, holding: Holding, Q: Array, R: Array, *, where: str) -> Array:
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
    driven = [j for j in range(G.shape[1]) if np.any(G[:, j])]
    inside = np.ix_(kept, kept)
    chosen = [names[i] for i in kept]
    K = np.zeros((G.shape[1], size))
    gain = regulator(
        F[inside],
        G[np.ix_(kept, driven)],
        Q[inside] * plan.dt,
        R[np.ix_(driven, driven)] * plan.dt,
        chosen,
        scale=np.array([typical(name) for name in chosen]),
        where=where,
    )
    K[np.ix_(driven, kept)] = gain
    return K


def design_model(model: LinearModel, plan: ObserverPlan, holding: Holding) -> tuple[Array, Array, tuple[str, ...]]:
    """Sampled model of states, late commands and integrals, with the names of its states."""
    F, G = zero_order_hold(model.A, model.B, plan.dt)
    F, G, added = with_late_inputs(F, G, plan.delays)
    errors = ("x", "y", "z", "psi") if holding == "place" else ("u", "v", "z", "psi")
    C = np.zeros((4, F.shape[0]))
    for row, name in enumerate(errors):
        C[row, model.states.index(name)] = 1.0
    augmented = np.block([[F, np.zeros((F.shape[0], 4))], [plan.dt * C, np.eye(4)]])
    waiting = [f"{model.inputs[j]} {ago} ago" for j, ago in added]
    return augmented, np.vstack([G, np.zeros((4, G.shape[1]))]), (*model.states, *waiting, *SUMS)


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
