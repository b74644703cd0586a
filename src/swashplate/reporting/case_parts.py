"""Cases side by side, each against the first: models, frequency responses, results; as tables, figures and JSON."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import combinations
from typing import Any

import numpy as np

from swashplate.arrays import Array, Complex
from swashplate.errors import SwashError
from swashplate.identification.core.result import APART, Estimate, Result
from swashplate.identification.frequency.response_cost import Target, cost_of, target
from swashplate.identification.responses.frequency_response import (
    LEAST_COHERENCE,
    TWO_PI,
    FrequencyResponse,
    decibel,
    unwrapped_degrees,
)
from swashplate.models.linear.answering import LinearResponse
from swashplate.models.usual_axes import usual_axes
from swashplate.reporting.structure import Cell, Figure, Key, Table, tabulate
from swashplate.reporting.theme import (
    BLACK,
    BLUE,
    GREEN,
    ORANGE,
    PURPLE,
    VERMILION,
    FigurePart,
    grid,
    line,
    phase_ticks,
)

STYLES = ((BLACK, "solid"), (BLUE, "dash"), (VERMILION, "dot"), (GREEN, "dashdot"), (PURPLE, "dash"), (ORANGE, "dot"))
MOST_PAIRS = 12
"""Bode diagrams in one figure."""


@dataclass(frozen=True)
class CaseParts:
    """One view of several cases.

    Attributes:
        tables, figures: what is shown.
        told: what a reader must know.
        document: the same numbers as JSON types.
    """

    tables: tuple[Table, ...] = ()
    figures: tuple[Figure, ...] = ()
    told: tuple[str, ...] = ()
    document: Mapping[str, Any] = field(default_factory=dict)

    def __add__(self, other: CaseParts) -> CaseParts:
        return CaseParts(
            (*self.tables, *other.tables),
            (*self.figures, *other.figures),
            (*self.told, *other.told),
            {**self.document, **other.document},
        )


Curve = tuple[Array, Complex]
"""Frequencies [rad/s] and a response at them."""


def bode_overlay(pairs: Mapping[tuple[str, str], Mapping[str, Curve]], *, whose: str = "") -> Figure:
    """Magnitude and phase of pairs (output, input), a line for each case that has it; phases by whole turns alike.

    `whose` they are is said below; cases by default.
    """
    shown = dict(list(pairs.items())[:MOST_PAIRS])
    names = list(dict.fromkeys(name for curves in shown.values() for name in curves))
    titles = [f"{o} / {i}, {what}" for o, i in shown for what in ("magnitude [dB]", "phase [deg]")]
    layout = grid(titles, columns=2, height=150, x_title="frequency [Hz]")
    layout["meta"] |= {"frequency": "Hz"}
    traces: list[FigurePart] = []
    for row, curves in enumerate(shown.values()):
        numbers = ["" if 2 * row + k == 0 else str(2 * row + k + 1) for k in (0, 1)]
        phases: list[Array] = []
        for name, (omega, h) in curves.items():
            phase = unwrapped_degrees(h)
            if phases:
                first = next(iter(curves.values()))
                there = np.isfinite(phases[0])
                apart = phase - np.interp(omega, first[0][there], phases[0][there]) if there.any() else np.zeros(1)
                known = apart[np.isfinite(apart)]
                phase = phase - 360.0 * np.round(np.median(known) / 360.0) if known.size else phase
            phases.append(phase)
            color, dash = STYLES[names.index(name) % len(STYLES)]
            for number, values in zip(numbers, (np.asarray(decibel(h)), phase), strict=True):
                traces.append(line(omega / TWO_PI, values, name=name, color=color, dash=dash, axis=number))
        for number in numbers:
            layout[f"xaxis{number}"] |= {"type": "log", "matches": None if number == "" else "x"}
        layout[f"yaxis{numbers[1]}"] |= phase_ticks(np.concatenate(phases))
    left_out = len(pairs) - len(shown)
    more = f" {left_out} more pairs are not drawn." if left_out else ""
    return Figure(
        "overlay",
        {"data": traces, "layout": layout},
        f"{whose or f'Responses of {len(names)} cases'} over each other.{more}",
        f"Bode diagrams of {', '.join(f'{o} over {i}' for o, i in shown)} for {', '.join(names)}.",
        keys=tuple(Key(n, *STYLES[k % len(STYLES)]) for k, n in enumerate(names)),
    )


def common(columns: Sequence[Sequence[str]]) -> list[str]:
    """What all have, in the order of the first."""
    return [name for name in columns[0] if all(name in other for other in columns[1:])]


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


_LARGE = 100.0
"""J of a good model is below it (Tischler and Remple 2012, ch. 11)."""


def compare_responses(cases: Mapping[str, FrequencyResponse]) -> CaseParts:
    """Every pair that all have: coherent bands, and how far each case is from the first where both are coherent.

    J is the mismatch cost that fits have (Tischler and Remple 2012, eq. 11.1), with the first case's coherence. The
    distance in sigmas is the root mean square over the lines of |ln H - ln H_1| over both random errors: about 1 where
    nothing but chance differs.

    Raises:
        SwashError: where they share no pair.
    """
    names, every = list(cases), list(cases.values())
    outputs, inputs = common([r.outputs for r in every]), common([r.inputs for r in every])
    if not (outputs and inputs):
        listed = "; ".join(f"{n}: {', '.join(r.outputs)} over {', '.join(r.inputs)}" for n, r in cases.items())
        raise SwashError(f"share no pair ({listed}).", channel="cases")
    rows, curves, document, remarks = [], {}, {}, []
    for pair in ((o, i) for o in outputs for i in inputs):
        if all(r.band(*pair) is None for r in every):
            continue
        curves[pair] = {n: (r.omega, _coherent(r, pair)) for n, r in cases.items()}
        first = every[0]
        entry = {}
        for name, one in cases.items():
            band = one.band(*pair)
            ends = "none" if band is None else f"{band[0] / TWO_PI:.3g} - {band[1] / TWO_PI:.3g}"
            far = None if name == names[0] else apart(first, one, pair)
            entry[name] = {"band": None if band is None else [b / TWO_PI for b in band], **(far or {})}
            cells = ["", "", "", ""] if far is None else [
                f"{far['magnitude']:.2f}", f"{far['phase']:.1f}", f"{far['J']:.1f}", f"{far['sigmas']:.1f}"
            ]  # fmt: skip
            tone = "caution" if far is not None and far["J"] > _LARGE else "plain"
            numbers = (Cell(cell, number=True, tone=tone) for cell in cells)
            rows.append((f"{pair[0]} / {pair[1]}", name, ends, *numbers))
            if far is not None and far["J"] > _LARGE:
                remarks.append(f"{pair[0]} / {pair[1]}: {name} differs from {names[0]} by J = {far['J']:.0f}.")
        document[f"{pair[0]}/{pair[1]}"] = entry
    shared = {(o, i) for o in outputs for i in inputs}
    alone = sorted({f"{o} / {i}" for r in every for o in r.outputs for i in r.inputs if (o, i) not in shared})
    if alone:
        remarks.append(f"Not in all cases, and left out: {', '.join(alone)}.")
    if not curves:
        raise SwashError("no pair is coherent in any case.", channel="cases")
    head = ("output / input", "case", "coherent band [Hz]", "magnitude [dB]", "phase [deg]", "J", "sigmas")
    note = f"Against {names[0]}, root mean squares over the lines where both are coherent (above {LEAST_COHERENCE:g})."
    table = tabulate("Responses", head, rows, note=note)
    return CaseParts((table,), (bode_overlay(curves),), tuple(remarks), {"responses": document})


def _coherent(one: FrequencyResponse, pair: tuple[str, str]) -> Complex:
    h, coherence, _ = one.pair(*pair)
    return np.where(coherence >= LEAST_COHERENCE, h, np.nan)


def apart(first: FrequencyResponse, other: FrequencyResponse, pair: tuple[str, str]) -> dict[str, float] | None:
    """How far a pair's response is from the first's: J, magnitude [dB], phase [deg] and sigmas; None without a band
    in which both are coherent."""
    band = other.band(*pair)
    wanted = None if band is None else target(first, *pair, band=(band[0] / TWO_PI, band[1] / TWO_PI))
    if wanted is None or wanted.omega.size < 2:
        return None
    h, sigma = _at(other, pair, wanted.omega)
    _, reference = _at(first, pair, wanted.omega)
    error = np.log(h / wanted.measured)
    spread = np.sqrt(reference**2 + sigma**2)
    known = spread > 0.0
    away = np.abs(error[known]) / spread[known] / np.sqrt(2.0)  # two parts, each with this deviation
    return {
        "J": cost_of(h, wanted),
        "magnitude": float(20.0 / np.log(10.0) * np.sqrt(np.mean(error.real**2))),
        "phase": float(np.degrees(np.sqrt(np.mean(error.imag**2)))),
        "sigmas": float(np.sqrt(np.mean(away**2))) if known.any() else float("nan"),
    }


def _at(one: FrequencyResponse, pair: tuple[str, str], omega: Array) -> tuple[Complex, Array]:
    """Response and random error between its lines: straight in the logarithms."""
    h, coherence, error = one.pair(*pair)
    known = np.isfinite(h) & (coherence >= LEAST_COHERENCE)
    where, log = np.log(one.omega[known]), np.log(np.abs(h[known])) + 1j * np.unwrap(np.angle(h[known]))
    x = np.log(omega)
    logarithm = np.interp(x, where, log.real) + 1j * np.interp(x, where, log.imag)
    return np.exp(logarithm), np.interp(x, where, error[known])


def compare_estimates(cases: Mapping[str, Result[object, object]]) -> CaseParts:
    """Values and standard deviations by parameter; differences from the first in standard deviations of the difference.

    The sigma of a difference is that of independent fits, sqrt(s1^2 + s2^2); fits to the same data are not, and that
    is said. The corrected bound is taken where a fit has one.
    """
    names = list(cases)
    parameters = list(dict.fromkeys(e.name for result in cases.values() for e in result.estimates))
    rows, document, remarks = [], {}, []
    for parameter in parameters:
        by_case = {n: next((e for e in r.estimates if e.name == parameter), None) for n, r in cases.items()}
        first = by_case[names[0]]
        unit = next(e.unit for e in by_case.values() if e is not None)
        entry: dict[str, Any] = {"unit": unit}
        cells = [parameter, unit]
        for name, e in by_case.items():
            cells += _of(e)
            sigma = float("nan") if e is None or not e.free else e.best_sigma
            entry[name] = None if e is None else {"value": e.value, "sigma": _finite(sigma)}
            if name == names[0]:
                continue
            away = distance(first, e)
            far = abs(away) > APART
            difference = "" if np.isnan(away) else f"{away:+.1f}"
            cells.append(Cell(difference, number=True, tone="caution" if far else "plain"))
            if e is not None:
                entry[name]["away"] = _finite(away)
            if far:
                remarks.append(f"{parameter}: {name} differs from {names[0]} by {abs(away):.1f} standard deviations.")
        rows.append((*cells,))
        document[parameter] = entry
    units = {p: {e.unit for r in cases.values() for e in r.estimates if e.name == p} for p in parameters}
    remarks += [f"{p} has different units: {', '.join(sorted(u))}." for p, u in units.items() if len(u) > 1]
    remarks += _shared_data(cases)
    head = ["parameter", "unit"]
    for name in names:
        head += [name, "CR [%]"] + (["sigmas away"] if name != names[0] else [])
    note = f"Sigmas away: difference from {names[0]} over that of independent fits; beyond {APART:g} they disagree."
    table = tabulate("Parameters", head, rows, note=note)
    return CaseParts((table,), told=tuple(remarks), document={"parameters": document})


def distance(first: Estimate | None, other: Estimate | None) -> float:
    """Difference in standard deviations; NaN where one is not there, has another unit, or both know no deviation."""
    if first is None or other is None or first.unit != other.unit:
        return float("nan")
    spread = math.hypot(*(e.best_sigma if e.free and np.isfinite(e.best_sigma) else 0.0 for e in (first, other)))
    return (other.value - first.value) / spread if spread > 0.0 else float("nan")


def _of(e: Estimate | None) -> list[Cell | str]:
    if e is None:
        return ["-", ""]
    known = e.free and np.isfinite(e.best_sigma) and e.value
    sigma = f"{100.0 * e.best_sigma / abs(e.value):.1f}" if known else "fixed" if e.fixed else ""
    percent = f"= {e.tie}" if e.tie else sigma
    return [f"{e.value:.5g}", percent]


def _finite(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


def _shared_data(cases: Mapping[str, Result[object, object]]) -> list[str]:
    """Fits that have seen the same data: their differences are less certain to be chance than the sigmas say."""
    logs = {n: {s.signals or f"{s.sha256} {s.name}": s.name for s in r.data} for n, r in cases.items()}
    pairs = [(a, b, sorted({logs[a][k] for k in logs[a].keys() & logs[b].keys()})) for a, b in combinations(cases, 2)]
    return [
        f"{a} and {b} have seen the same data ({', '.join(both)}): their differences are more significant than the "
        "sigmas of independent fits say."
        for a, b, both in pairs
        if both
    ]
