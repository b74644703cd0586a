"""Frequency responses of several cases side by side, each against the first."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from swashplate.arrays import Array, Complex
from swashplate.errors import SwashError
from swashplate.identification.frequency.response_cost import cost_of, target
from swashplate.identification.responses.frequency_response import LEAST_COHERENCE, TWO_PI, FrequencyResponse
from swashplate.reporting.case_parts import CaseParts, bode_overlay, common
from swashplate.reporting.structure import Cell, tabulate

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
