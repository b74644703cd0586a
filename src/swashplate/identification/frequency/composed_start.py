"""Start values of a composed structure: its core is regressed on the responses, and the rotor made from that.

A first-order tip-path plane that follows at once makes Lp = -Lb tau_f and Llat = Lb Blat (Tischler and Remple 2012,
ch. 15), so that a quasi-steady body and a time constant give all of its numbers.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from swashplate.identification.frequency.linear_start import by_regression
from swashplate.identification.responses.frequency_response import FrequencyResponse
from swashplate.models.linear.composition import PREFIX, parts_of
from swashplate.models.linear.state_space import StateSpaceModel
from swashplate.models.linear.state_space_file import structure
from swashplate.models.linear.structure_parts import PARTS

LAGS = (0.03, 0.08, 0.2)
"""Time constants of the tip-path plane that are tried [s]."""

_QUASI_STEADY = ("coupled",)
_LEAST = 1e-6


def from_core(
    model: StateSpaceModel, responses: FrequencyResponse, *, band: tuple[float, float] | None = None
) -> dict[str, StateSpaceModel]:
    """Starts of a composed model by where they come from; none for a structure that is not composed.

    Args:
        model: what needs start values. responses: measured. band: limits [Hz].
    """
    composed = str(model.document.get("composed", ""))
    if not composed:
        return {}
    parts = parts_of(composed)
    kept = [name for name in parts if PARTS[name].core or name in _QUASI_STEADY]
    if len(kept) == len(parts):
        return {}  # it is regressed as it is
    core = by_regression(structure(PREFIX + "+".join(kept)), responses, band=band)
    if core is None:
        return {}
    known = core.numbers()
    shared = {n: known[n] for n in model.free if n in known}
    flaps = "tau_f" in model.parameters
    starts = {}
    for lag in LAGS if flaps else (0.0,):
        values = shared | (_rotor(known, lag) if flaps else {})
        words = "regression on the core" + (f", tip-path plane of {lag:g} s" if flaps else "")
        starts[words] = model.with_values({n: _within(model, n, v) for n, v in values.items() if n in model.free})
    return starts


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
