"""Start values that need none: the equations of motion as regressions on measured responses.

Where outputs and kinematics give the responses of all states, M jw X = F X + G U e^(-jw tau) is linear in the entries
of F and G, row by row (equation error in the frequency domain: Klein and Morelli 2006, sec. 7.3; as starting values:
Tischler and Remple 2012, ch. 13). Where some states are hidden (a rotor), only the controls' columns are matched in
sign and size; or the lags of the hidden states are held, with which the inputs and the other states make them.

Start values of a composed structure: from a relative that is fitted, or from its core and the responses.

A structure with a part more than a fitted one begins where the other has ended, with the part so that it does nothing:
then it answers as the other does, and a fit cannot end above it. Without a relative the core is regressed on the
responses, and the rotor made from that: a first-order tip-path plane that follows at once makes Lp = -Lb tau_f and
Llat = Lb Blat (Tischler and Remple 2012, ch. 15), so that a quasi-steady body and a time constant give all of its
numbers.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from swashplate.arrays import Array, Complex
from swashplate.identification.frequency.response_cost import Target
from swashplate.identification.responses.frequency_response import FrequencyResponse
from swashplate.models.linear.composition import PREFIX, nonsense, parts_of
from swashplate.models.linear.state_space import Element, StateSpaceModel
from swashplate.models.linear.state_space_file import structure
from swashplate.models.linear.structure_parts import HELD, PARTS, SERVO, SHORT

LAGS = (0.03, 0.08, 0.2)
"""Time constants of the tip-path plane that are tried [s]."""

_QUASI_STEADY = ("coupled",)
_LEAST = 1e-6


def from_core(
    model: StateSpaceModel,
    responses: FrequencyResponse,
    *,
    band: tuple[float, float] | None = None,
    regressed: dict[str, StateSpaceModel | None] | None = None,
) -> dict[str, StateSpaceModel]:
    """Starts of a composed model by where they come from; none for a structure that is not composed.

    Args:
        model: what needs start values. responses: measured. band: limits [Hz].
        regressed: cores that were regressed on these responses already, by name; new ones are added.
    """
    composed = str(model.document.get("composed", ""))
    if not composed:
        return {}
    parts = parts_of(composed)
    kept = [name for name in parts if name in PARTS and (PARTS[name].core or name in _QUASI_STEADY)]
    kept += [name for name in parts if name not in PARTS and not nonsense([*kept, name])]
    if len(kept) == len(parts):
        return {}  # it is regressed as it is
    cores = {} if regressed is None else regressed
    begun = structure(PREFIX + "+".join(kept))
    if begun.name not in cores:
        about = {n: model.parameters[n].value for n in HELD if n in begun.parameters and n in model.parameters}
        cores[begun.name] = by_regression(begun.with_values(about), responses, band=band)
    core = cores[begun.name]
    if core is None:
        return {}
    known = core.numbers()
    shared = {n: known[n] for n in model.free if n in known}
    flaps = "tau_f" in model.parameters
    starts = {}
    for lag in LAGS if flaps else (0.0,):
        values = shared | (_rotor(known, lag) if flaps else {})
        origin = "regression on the core" + (f", tip-path plane of {lag:g} s" if flaps else "")
        starts[origin] = model.with_values({n: _within(model, n, v) for n, v in values.items() if n in model.free})
    return starts


def from_relative(model: StateSpaceModel, relative: StateSpaceModel) -> StateSpaceModel:
    """A composed model with the numbers of a fitted relative; what the relative lacks does nothing.

    Exact but for an inflow, which is made to follow at once what it will follow with its lag, and for actuators, whose
    lag is taken from the delays.
    """
    fitted = relative.numbers()
    values = {name: fitted[name] for name in model.free if name in fitted}
    parts, others = (parts_of(str(one.document["composed"])) for one in (model, relative))
    added = [name for name in parts if name not in others]
    for name in added:
        values |= PARTS[name].absent if name in PARTS else dict.fromkeys((name,), TIED.get(name, 0.0))
    if "inflow" in added:
        values |= _followed_at_once(model.numbers() | values)
    if "actuators" in added:
        values |= _out_of_the_delays(model.numbers() | values)
    return model.with_values({n: _within(model, n, v) for n, v in values.items() if n in model.free})


TIED = PARTS["forces"].absent
"""Derivatives that a rotor has tied, not zero, where they are not free."""


def _followed_at_once(known: Mapping[str, float]) -> dict[str, float]:
    """Thrust derivatives with a frozen inflow from those in `known`, which are with one that follows at once."""
    rate, mass = known["rate_nu"], known["mass_nu"]
    frozen = known["Zw"] * rate / max(0.5 * rate + mass * known["Zw"], _LEAST * rate)
    values = {"Zw": frozen}
    return values | ({"Zcol": known["Zcol"] * (rate - mass * frozen) / rate} if "Zcol" in known else {})


def _out_of_the_delays(known: Mapping[str, float]) -> dict[str, float]:
    """Delays that are shorter by the actuators' lags, and lags that are no longer than their delays."""
    values: dict[str, float] = {}
    for lag in dict.fromkeys(SERVO.values()):
        lags = [f"tau_{SHORT[name]}" for name, servo in SERVO.items() if servo == lag and f"tau_{SHORT[name]}" in known]
        values[lag] = min((known[lag], *(known[name] for name in lags)))
        values |= {name: known[name] - values[lag] for name in lags}
    return values


def _rotor(known: Mapping[str, float], lag: float) -> dict[str, float]:
    """The tip-path plane that is, where it follows at once, what the core's derivatives say.

    C (b, a) = -tau_f (p, q) + (B, A) u with C = (1, -Ba; -Ab, 1), and the moments are (Lb b, Ma a).
    """
    rates = np.array([[known["Lp"], known["Lq"]], [known["Mp"], known["Mq"]]])
    if abs(np.linalg.det(rates)) < _LEAST:
        return {}
    inverse = np.linalg.inv(rates)
    roll, pitch = (1.0 / (lag * max(abs(inverse[k, k]), _LEAST)) for k in (0, 1))
    flap = {"tau_f": lag, "Lb": roll, "Ma": pitch, "Ba": lag * inverse[0, 1] * pitch, "Ab": lag * inverse[1, 0] * roll}
    for short in ("lat", "lon"):
        b, a = -lag * inverse @ np.array([known[f"L{short}"], known[f"M{short}"]])
        flap |= {f"B{short}": float(b), f"A{short}": float(a)}
    return flap


def _within(model: StateSpaceModel, name: str, value: float) -> float:
    p = model.parameters[name]
    return float(np.clip(value, p.lower, p.upper))


LINES = 40
"""Frequencies of the regression, evenly in log frequency."""

DELAYS = np.linspace(0.0, 0.12, 13)
"""Delays tried for each input [s]."""

HELD_LAGS = (0.5, 1.0, 2.0, 4.0)
"""Of a lag's start value, at which hidden states are held."""

_WORST = 1e4
_ROUNDS, _FLOOR = 5, 0.03


def other_starts(
    model: StateSpaceModel,
    responses: FrequencyResponse,
    targets: Sequence[Target],
    *,
    band: tuple[float, float] | None = None,
) -> dict[str, StateSpaceModel]:
    """Starts that the responses themselves suggest, by where they come from."""
    starts = {
        "regression on the responses": by_regression(model, responses, band=band),
        "controls matched to the responses": by_controls(model, targets),
    }
    if starts["regression on the responses"] is None:
        for share, held in _lags_held(model).items():
            known = by_regression(held, responses, band=band)
            if known is not None:
                origin = f"regression with lags at {share:g} of their start values"
                starts[origin] = model.with_values({n: known.parameters[n].value for n in model.free})
    return {name: one for name, one in starts.items() if one is not None}


def _lags_held(model: StateSpaceModel) -> dict[float, StateSpaceModel]:
    """The model with its states' time constants held, by the share of their start values; none without any."""
    lags = {n for e in model.elements if e.matrix == "M" for n in e.expression.names} & set(model.free)
    values = {n: model.parameters[n].value for n in lags}
    return {
        k: model.with_values(_bounded(model, {n: k * v for n, v in values.items()}), free=False)
        for k in (HELD_LAGS if lags else ())
    }


def by_regression(
    model: StateSpaceModel, responses: FrequencyResponse, *, band: tuple[float, float] | None = None
) -> StateSpaceModel | None:
    """The model with every free entry of F and G that is one parameter taken from the responses.

    Returns:
        None where the responses do not hold all outputs that the states need, or an entry cannot be told.
    """
    if any(name not in responses.inputs for name in model.inputs):
        return None
    measured = [o for o in model.outputs if o in responses.outputs]
    part = responses.select(tuple(measured), model.inputs) if measured else None
    if part is None or model.free == ():
        return None
    low, high = (0.0, np.inf) if band is None else (2.0 * np.pi * band[0], 2.0 * np.pi * band[1])
    usable = np.flatnonzero(
        np.all(np.isfinite(part.response), axis=(1, 2)) & (part.omega >= low) & (part.omega <= high)
    )
    if usable.size < LINES // 2:
        return None
    usable = usable[np.unique(np.linspace(0, usable.size - 1, LINES).astype(int))]
    states, spread = _states(model, part, usable, [model.outputs.index(o) for o in measured])
    if states is None:
        return None
    omega = part.omega[usable]
    rows = [k for k in range(len(model.states)) if _entries(model, k)]
    lag = dict.fromkeys(model.inputs, 0.0)
    for _ in range(2):
        for name in model.inputs:
            if any(key.rpartition("/")[2] == name for key in model.delays):
                cost = [_regressed(model, rows, omega, states, spread, {**lag, name: float(d)})[1] for d in DELAYS]
                lag[name] = float(DELAYS[int(np.argmin(cost))])
    values, _ = _regressed(model, rows, omega, states, spread, lag)
    if values is None:
        return None
    for name, expression in model.delays.items():
        if expression.text in model.free:
            values[expression.text] = lag[name.rpartition("/")[2]]
    return model.with_values(_bounded(model, values))


def _states(
    model: StateSpaceModel, part: FrequencyResponse, at: NDArray[np.intp], rows: Sequence[int]
) -> tuple[Complex | None, Array]:
    """Responses of all states and their errors, (n_f, n_states, n_inputs), by outputs and parameter-free equations."""
    m = model.matrices()
    fixed = [k for k in range(len(model.states)) if not _entries(model, k)]
    responses = np.zeros((at.size, len(model.states), len(model.inputs)), dtype=np.complex128)
    spread = np.zeros(responses.shape)
    for n, f in enumerate(at):
        s = 1j * part.omega[f]
        left = np.concatenate([m["H0"][rows] + s * m["H1"][rows], s * m["M"][fixed] - m["F"][fixed]])
        error = part.error[f] * np.abs(part.response[f])
        right = np.concatenate([part.response[f] - m["D"][rows], m["G"][fixed].astype(np.complex128)])
        sure = np.concatenate([np.maximum(error, 1e-12), np.full((len(fixed), len(model.inputs)), 1e-7)])
        for i in range(len(model.inputs)):
            scaled = left / sure[:, i, None]
            size = np.maximum(np.linalg.norm(scaled, axis=0), 1e-300)
            if np.linalg.matrix_rank(scaled / size, tol=1e-10) < len(model.states):
                return None, spread
            inverse = np.linalg.pinv(scaled / size, rcond=1e-13) / size[:, None]
            responses[n, :, i] = inverse @ (right[:, i] / sure[:, i])
            spread[n, :, i] = np.linalg.norm(inverse, axis=1)
    return responses, spread


def _entries(model: StateSpaceModel, row: int) -> list[tuple[Element, str, float]]:
    """Entries of a row that are a free parameter, or minus one, with the sign."""
    entries = []
    for e in model.elements:
        text = e.expression.text.replace(" ", "")
        name = text.lstrip("-")
        if e.matrix in ("F", "G") and e.row == row and name in model.free:
            entries.append((e, name, -1.0 if text.startswith("-") else 1.0))
    return entries


def _regressed(
    model: StateSpaceModel, rows: Sequence[int], omega: Array, states: Complex, spread: Array, lag: dict[str, float]
) -> tuple[dict[str, float] | None, float]:
    m, s = model.matrices(), 1j * omega[:, None]
    drive = np.exp(-s[:, :, None] * np.array([lag[name] for name in model.inputs])) * np.ones((omega.size, 1, 1))
    values: dict[str, float] = {}
    total = 0.0
    for k in rows:
        entries = _entries(model, k)
        free = {(e.matrix, e.column) for e, _, _ in entries}
        # Known entries go to the left: M jw X - F X - G U.
        f_known = np.array([0.0 if ("F", j) in free else m["F"][k, j] for j in range(len(model.states))])
        g_known = np.array([0.0 if ("G", j) in free else m["G"][k, j] for j in range(len(model.inputs))])
        left = s * np.einsum("j,fji->fi", m["M"][k], states) - np.einsum("j,fji->fi", f_known, states)
        left = left - g_known * drive[:, 0, :]
        columns = []
        for e, _, sign in entries:
            column = np.zeros(left.shape, dtype=np.complex128)
            if e.matrix == "F":
                column = sign * states[:, e.column, :]
            else:
                column[:, e.column] = sign * drive[:, 0, e.column]
            columns.append(column.ravel())
        table, right = np.stack(columns, axis=1), left.ravel()
        # Forces that cancel to a small acceleration: errors of every term count, by what the last round made of it.
        noise = np.full(left.size, np.median(np.abs(left)))
        solved = np.zeros(len(entries))
        for _ in range(_ROUNDS):
            solved, rank = _weighted(table, right, noise)
            if rank == 0:
                return None, float("inf")
            row = f_known.copy()
            for (e, _, sign), value in zip(entries, solved, strict=True):
                row[e.column] += sign * value if e.matrix == "F" else 0.0
            errors = np.einsum("j,fji->fi", row**2, spread**2) + (np.abs(s) * spread[:, k, :]) ** 2
            noise = np.sqrt(errors + (_FLOOR * np.abs(left)) ** 2).ravel() + 1e-9
        miss = (table @ solved - right) / noise
        total += float(np.vdot(miss, miss).real + 2.0 * np.sum(np.log(noise)))
        values |= {name: float(v) for (_, name, _), v in zip(entries, solved, strict=True)}
    return values, total


def _weighted(table: Complex, right: Complex, noise: Array) -> tuple[Array, int]:
    """Real least squares of complex equations with their noise: numbers, and how many of them were told."""
    scaled, target = table / noise[:, None], right / noise
    size = np.maximum(np.linalg.norm(scaled, axis=0), 1e-300)
    stacked = np.concatenate([scaled.real, scaled.imag]) / size
    solution, _, rank, _ = np.linalg.lstsq(stacked, np.concatenate([target.real, target.imag]), rcond=1e-6)
    return np.asarray(solution / size), int(rank)


def by_controls(model: StateSpaceModel, targets: Sequence[Target]) -> StateSpaceModel | None:
    """The model with each control's column turned and scaled to the strongest response that it has.

    Returns:
        None where a column cannot be matched.
    """
    changes: dict[str, float] = {}
    for i, name in enumerate(model.inputs):
        of_input = [t for t in targets if t.input == name]
        column = {
            e.expression.text.replace(" ", "").lstrip("-")
            for e in model.elements
            if e.matrix in ("G", "D") and e.column == i
        } & set(model.free)
        ratios = []
        for t in of_input:
            h = model.response(t.omega)[:, model.outputs.index(t.output), i]
            if np.all(np.isfinite(h)) and np.all(np.abs(h) > 0.0):
                ratio = t.measured / h
                strength = float(np.sum(t.coherence)) * np.log(t.omega[-1] / t.omega[0])
                steady = abs(np.mean(ratio / np.abs(ratio)))
                ratios.append((strength * steady, ratio))
        if not ratios or not column:
            continue
        _, ratio = max(ratios, key=lambda pair: pair[0])
        size = float(np.clip(np.exp(np.median(np.log(np.abs(ratio)))), 1.0 / _WORST, _WORST))
        sign = -1.0 if np.mean((ratio / np.abs(ratio)).real) < 0.0 else 1.0
        changes |= {n: sign * size * model.parameters[n].value for n in column}
    return model.with_values(_bounded(model, changes)) if changes else None


def _bounded(model: StateSpaceModel, values: dict[str, float]) -> dict[str, float]:
    return {n: float(np.clip(v, model.parameters[n].lower, model.parameters[n].upper)) for n, v in values.items()}
