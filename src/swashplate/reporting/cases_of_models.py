"""Models of several cases side by side: modes, and responses over each other."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from swashplate.arrays import Complex
from swashplate.identification.frequency.response_cost import Target, cost_of
from swashplate.identification.responses.frequency_response import TWO_PI
from swashplate.models.linear.answering import LinearResponse
from swashplate.models.usual_axes import usual_axes
from swashplate.reporting.case_parts import CaseParts, bode_overlay, common
from swashplate.reporting.structure import tabulate

BAND = np.geomspace(0.1, 5.0, 60) * TWO_PI
"""rad/s."""
_SAME = 0.5
"""Relative distance up to which two eigenvalues are taken for the same mode."""
_RATES = {"roll": "p", "pitch": "q", "yaw": "r", "heave": "w"}
_ORIGIN = 1e-5


def compare_modes(cases: Mapping[str, LinearResponse]) -> CaseParts:
    """Eigenvalues [1/s], those of the first with the nearest of the others, and the difference in per cent."""
    names = list(cases)
    by_case = {name: eigenvalues(model) for name, model in cases.items()}
    first = by_case[names[0]]
    matched = {name: match(first, values) for name, values in by_case.items()}
    rows, entries = [], []
    for k, value in enumerate(first):
        mine = {name: None if (j := places[k]) is None else by_case[name][j] for name, places in matched.items()}
        cells = [_shown(value)]
        for name in names[1:]:
            other = mine[name]
            cells += ["-", "-"] if other is None else [
                _shown(other), f"{100.0 * abs(other - value) / abs(value):.1f}"
            ]  # fmt: skip
        rows.append((*cells,))
        entries.append({name: None if v is None else [float(v.real), float(v.imag)] for name, v in mine.items()})
    for name in names[1:]:
        for j in sorted(set(range(len(by_case[name]))) - {j for j in matched[name] if j is not None}):
            value = by_case[name][j]
            cells = ["-"]
            for column in names[1:]:
                cells += [_shown(value), ""] if column == name else ["-", "-"]
            rows.append((*cells,))
            entries.append({n: [float(value.real), float(value.imag)] if n == name else None for n in names})
    head = (names[0], *(title for name in names[1:] for title in (name, "away [%]")))
    note = f"Eigenvalues [1/s] (natural frequency [rad/s], damping); the nearest within {100 * _SAME:.0f} %, '-' none."
    return CaseParts((tabulate("Modes", head, rows, note=note),), document={"modes": entries})


def eigenvalues(model: LinearResponse) -> list[complex]:
    """With imaginary part zero or more, slowest last; those at the origin are no modes."""
    values = [complex(v) for v in model.eigenvalues() if v.imag >= 0.0 and abs(v) > _ORIGIN]
    return sorted(values, key=lambda v: (-abs(v), v.imag))


def match(first: Sequence[complex], other: Sequence[complex]) -> list[int | None]:
    """For each eigenvalue of the first the other's that is it, None for none: nearest over all at once."""
    if not (first and other):
        return [None] * len(first)
    from scipy.optimize import linear_sum_assignment  # a tenth of a second, and every report imports this module

    a, b = np.array(first)[:, None], np.array(other)[None, :]
    away = np.abs(a - b) / np.maximum(np.abs(a), np.abs(b))
    rows, columns = linear_sum_assignment(np.minimum(away, 2.0 * _SAME))
    partners: list[int | None] = [None] * len(first)
    for i, j in zip(rows, columns, strict=True):
        partners[int(i)] = int(j) if away[i, j] <= _SAME else None
    return partners


def _shown(value: complex) -> str:
    if abs(value.imag) < 1e-9:
        return f"{value.real:+.3f}"
    return f"{value.real:+.3f} +/- {value.imag:.3f}j ({abs(value):.2f}, {-value.real / abs(value):.2f})"


def compare_answers(cases: Mapping[str, LinearResponse]) -> CaseParts:
    """Responses over each other from 0.1 to 5 Hz, delays included, and J of each against the first.

    Pairs of an axis (p over roll ...) where inputs are named as usual; otherwise all that the models share.
    """
    every = list(cases.values())
    inputs, outputs = common([m.inputs for m in every]), common([m.outputs for m in every])
    axes = {axis.name: name for axis in usual_axes(inputs) for name in axis.inputs if len(axis.inputs) == 1}
    pairs = [(_RATES[axis], name) for axis, name in axes.items() if _RATES[axis] in outputs]
    pairs = pairs or [(o, i) for o in outputs for i in inputs]
    if not pairs:
        return CaseParts(told=("The models share no output and input: their responses are not compared.",))
    names = list(cases)
    answers = {name: response(model, outputs, inputs) for name, model in cases.items()}
    curves, rows, document = {}, [], {}
    for o, i in pairs:
        mine = {n: h[:, outputs.index(o), inputs.index(i)] for n, h in answers.items()}
        if not any(np.any(h != 0.0) for h in mine.values()):
            continue
        curves[o, i] = {n: (BAND, np.where(h == 0.0, np.nan, h)) for n, h in mine.items()}
        wanted = Target(o, i, BAND, mine[names[0]], np.ones(BAND.size))
        costs = {n: cost_of(mine[n], wanted) if np.all(mine[n] != 0.0) and np.all(wanted.measured != 0.0) else np.inf
                 for n in names[1:]}  # fmt: skip
        rows.append((f"{o} / {i}", *(f"{c:.1f}" for c in costs.values())))
        document[f"{o}/{i}"] = {n: c if np.isfinite(c) else None for n, c in costs.items()}
    if not curves:
        return CaseParts(told=("No output of the models answers an input.",))
    caption, note = ("Mismatch J of responses", f"Against {names[0]}, from 0.1 to 5 Hz; a good model has 100 at most.")
    table = tabulate(caption, ("output / input", *names[1:]), rows, note=note)
    return CaseParts((table,), (bode_overlay(curves),), document={"responses": document})


def response(model: LinearResponse, outputs: Sequence[str], inputs: Sequence[str]) -> Complex:
    """H(j omega) over BAND with delays, shape (n, n_outputs, n_inputs)."""
    o, i = ([every.index(n) for n in names] for every, names in ((model.outputs, outputs), (model.inputs, inputs)))
    return np.asarray(model.response(BAND)[:, o][:, :, i], dtype=np.complex128)
