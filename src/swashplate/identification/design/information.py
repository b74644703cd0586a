"""What a maneuver would tell of some parameters before it is flown: Fisher information line by line.

About steady flight the motion at a frequency is `X = (jw - A)^-1 B U`, and a parameter moves it by
`(jw - A)^-1 (A' X + B' U)`, with A' and B' by differences of exact slopes. The innovations of a filter see that through
the inverse of what disturbed air and sensors add to the outputs, so a line of amplitude c flown for T seconds adds
`T / 2 c^2 Re(S^H Phi^-1 S)` (Goodwin and Payne 1977, ch. 6; Ljung 1999, sec. 13.4). U is what the inputs do in the
closed loop. A delay of all inputs together is taken for unknown, as the fits take it. What gusts add to the inputs is
left out, which widens the bounds; trims, lever arms and the noise's own numbers are taken for known, which narrows
them.

How much power each line of each axis is to have, so that the lines together tell most.

Information is linear in the powers and the logarithm of its determinant is concave, so the best powers are found by
multiplying each by what it tells more than the mean (Titterington 1976; Yu 2010), each axis within what it may have.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from swashplate.arrays import Array, Complex
from swashplate.engine.equations import SURROUNDINGS, equations_of, parameter_row
from swashplate.engine.slopes import rates_and_slopes
from swashplate.errors import IdentificationError
from swashplate.filtering.disturbances import DISTURBED, Noise, on_axes
from swashplate.identification.core.records import POSE
from swashplate.models.linear.linear_vehicle import structure_of
from swashplate.models.vehicle import Vehicle
from swashplate.simulation.trim import Trim, trim

ROUNDS = 300


def best_powers(
    information: Array,
    owner: NDArray[np.intp],
    allowed: Array,
    known: Array,
    *,
    criterion: str,
    worst: bool,
) -> Array:
    """Mean squares of the lines, (lines,).

    Args:
        information: of each line per unit of power, for each draw of the prior, (draws, lines, q, q), scaled.
        owner: axis of each line (lines,). allowed: power of each axis (axes,).
        known: information beforehand (q, q), scaled.
        criterion: "D" (least volume) or "A" (least sum of variances) of all but the last number, which is a nuisance.
        worst: True for the best in the worst draw, False on average.
    """
    axes = len(allowed)
    count = np.bincount(owner, minlength=axes)
    power = (allowed / np.maximum(count, 1))[owner]
    weights = np.full(len(information), 1.0 / len(information))
    for _ in range(ROUNDS):
        gains, values = [], []
        for lines in information:
            total = known + np.einsum("l,lij->ij", power, lines)
            inverse = np.linalg.pinv(total, hermitian=True)
            kept = inverse[:-1, :-1]
            # By the inverse's block: the parameters alone, the nuisance marginalised.
            if criterion == "A":
                total_variance = np.trace(kept)
                middle = inverse[:, :-1] @ inverse[:-1, :] / total_variance
                values.append(-np.log(total_variance))
            else:
                middle = inverse[:, :-1] @ np.linalg.pinv(kept, hermitian=True) @ inverse[:-1, :]
                values.append(-np.linalg.slogdet(kept)[1])
            gains.append(np.einsum("ij,lij->l", middle, lines))
        if worst:
            weights *= np.exp(-0.3 * (np.array(values) - np.min(values)))
            weights /= weights.sum()
        gain = np.maximum(weights @ np.array(gains), 0.0)
        for axis in range(axes):
            mask = owner == axis
            share = power[mask] * np.sqrt(gain[mask])  # the square root converges for A too, and hardly slower for D
            total_moved = share.sum()
            if total_moved > 0.0:
                power[mask] = allowed[axis] * share / total_moved
    return np.asarray(power)


DELAY_SIGMA = 0.05
"""Prior standard deviation [s] of the delay that is unknown, as in the fits."""


_STEP = 1e-4
"""Share of a parameter, for differences of exact slopes: a helicopter's slopes of slopes compile for minutes."""
_TOLD, _PART = 1e-12, 1e-18
"""Share of the information below which a direction is not told, and the part in one from which a parameter is not."""


@dataclass(frozen=True)
class Sensed:
    """A linear model with slopes by the parameters in question.

    Attributes:
        A, B: about steady flight (n, n), (n, m).
        dA, dB: slopes by the parameters (n, n, p), (n, m, p).
        outputs, disturbed: places of the measured and of the disturbed states.
        trim: steady flight.
    """

    A: Array
    B: Array
    dA: Array
    dB: Array
    outputs: Array
    disturbed: Array
    trim: Trim


def sensed(vehicle: Vehicle, unknown: Sequence[str]) -> Sensed:
    """The linear model of a vehicle in hover with its slopes by some parameters.

    Raises:
        IdentificationError: an unknown parameter, or a vehicle without tracked pose or body rates.
    """
    strange = [name for name in unknown if name not in vehicle.numbers]
    if strange or not unknown:
        raise IdentificationError(
            f"is no parameter of '{vehicle.called}'." if strange else "names nothing.",
            channel=", ".join(strange) or "unknown",
            hint=f"It has {', '.join(vehicle.numbers)}.",
        )
    lacking = [name for name in (*POSE, *DISTURBED) if name not in vehicle.state_names]
    if lacking:
        raise IdentificationError(
            f"'{vehicle.name}' has no such states, and the noise of flights is known for a tracked pose only.",
            channel=", ".join(lacking),
        )
    about = trim(vehicle)
    around = [getattr(about.environment, name) for name in SURROUNDINGS]
    w = np.array([*about.inputs, *around], dtype=np.float64)
    p = parameter_row(vehicle, about.environment)
    m, equations = len(vehicle.input_names), equations_of(vehicle)

    def slopes(row: Array) -> Array:
        return np.concatenate(rates_and_slopes(equations, about.state, w, row)[1:], axis=1)

    def slopes_aside(name: str, step: float) -> Array:
        if vehicle.structure is not None:
            return _structured(vehicle, name, step)
        return slopes(p + step * np.eye(p.size)[vehicle.parameter_names.index(name)])

    steps = {name: _STEP * max(abs(vehicle.numbers[name].value), 1e-6) for name in unknown}
    by = np.stack(
        [(slopes_aside(n, step) - slopes_aside(n, -step)) / (2.0 * step) for n, step in steps.items()], axis=-1
    )
    here, n = slopes(p), len(vehicle.state_names)
    return Sensed(
        here[:, :n],
        here[:, n : n + m],
        by[:, :n],
        by[:, n : n + m],
        np.array([vehicle.index(name) for name in POSE]),
        np.array([vehicle.index(name) for name in DISTURBED]),
        about,
    )


def _structured(vehicle: Vehicle, name: str, step: float) -> Array:
    """A and B side by side (n, n + m) with one parameter of the structure moved; rows of kinematics are left zero."""
    model = structure_of(vehicle)
    A, B, _, _ = model.with_values({name: model.parameters[name].value + step}).explicit()
    n, at = len(vehicle.state_names), [vehicle.index(state) for state in model.states]
    columns = [*at, *(n + vehicle.input_names.index(one) for one in model.inputs)]
    side_by_side = np.zeros((n, n + len(model.inputs)))
    side_by_side[np.ix_(at, columns)] = np.hstack([A, B])
    return side_by_side


def output_noise(model: Sensed, frequency: Array, noise: Noise, *, rate: float) -> Complex:
    """Two-sided power density of what air and sensors add to the outputs, (f, outputs, outputs).

    Args:
        model: of the vehicle. frequency: [Hz], above zero.
        noise: of air and sensors, as the likelihoods have it.
        rate: of the log [Hz].
    """
    w = 2.0 * np.pi * frequency
    white = on_axes(noise.white_horizontal, noise.white_vertical, noise.white_tilt, noise.white_yaw)
    gust = on_axes(noise.gust_horizontal, noise.gust_vertical, noise.gust_tilt, noise.gust_yaw)
    force, moment = noise.tau_gust_force, noise.tau_gust_moment  # yaw and heave may have their own
    tau = on_axes(force, noise.tau_gust_vertical or force, moment, noise.tau_gust_yaw or moment)
    force, moment = noise.drift_force, noise.drift_moment
    drift = on_axes(force, noise.drift_vertical or force, moment, noise.drift_yaw or moment)
    power = [a**2 + b**2 / (w**2 + t**-2.0) + c**2 / w**2 for a, b, t, c in zip(white, gust, tau, drift, strict=True)]
    way = _resolvent(model, w)[:, model.outputs][:, :, model.disturbed]
    spread = np.einsum("fij,jf,fkj->fik", way, np.array(power), way.conj())
    angle, heading = noise.sensor_angle, noise.sensor_heading or noise.sensor_angle
    sensors = np.array([noise.sensor_position] * 3 + [angle, angle, heading]) ** 2 / rate
    return np.asarray(spread + np.diag(sensors))


def line_information(model: Sensed, frequency: Array, inputs: Complex, noise: Noise, *, rate: float) -> Array:
    """Information per second of what the inputs do at each line, (f, p + 1, p + 1); the last is the common delay.

    Args:
        model: with its slopes.
        frequency: of the lines [Hz].
        inputs: their amplitudes there, (f, m), complex.
        noise: of air and sensors. rate: of the log [Hz].
    """
    w = 2.0 * np.pi * frequency
    resolvent = _resolvent(model, w)
    states = np.einsum("fij,jk,fk->fi", resolvent, model.B, inputs)
    pushed = np.einsum("ijp,fj->fip", model.dA, states) + np.einsum("imp,fm->fip", model.dB, inputs)
    states_by = np.einsum("fij,fjp->fip", resolvent, pushed)
    by_delay = (-1j * w[:, None] * states)[:, :, None]
    slopes = np.concatenate([states_by, by_delay], axis=2)[:, model.outputs]
    weighed = np.linalg.solve(output_noise(model, frequency, noise, rate=rate), slopes)
    return np.asarray(0.5 * np.einsum("fip,fiq->fpq", slopes.conj(), weighed).real)


def _resolvent(model: Sensed, w: Array) -> Complex:
    return np.asarray(np.linalg.inv(1j * w[:, None, None] * np.eye(len(model.A)) - model.A), dtype=np.complex128)


def bounds_from(information: Array) -> Array:
    """Standard deviations of the parameters, (p,), with the delay unknown; infinite where nothing is told."""
    total = np.array(information)
    total[-1, -1] += DELAY_SIGMA**-2.0
    scale = np.sqrt(np.maximum(np.diag(total), 1e-300))
    scaled = total / np.outer(scale, scale)
    values, vectors = np.linalg.eigh(scaled)
    known = values > _TOLD
    variance = np.sum(vectors[:, known] ** 2 / values[known], axis=1)
    variance[np.any(vectors[:, ~known] ** 2 > _PART, axis=1)] = np.inf
    return np.asarray((np.sqrt(variance) / scale)[:-1])
