"""Start values of a composed structure: from a relative that is fitted, or from its core and the responses.

A structure with a part more than a fitted one begins where the other has ended, with the part so that it does nothing:
then it answers as the other does, and a fit cannot end above it. Without a relative the core is regressed on the
responses, and the rotor made from that: a first-order tip-path plane that follows at once makes Lp = -Lb tau_f and
Llat = Lb Blat (Tischler and Remple 2012, ch. 15), so that a quasi-steady body and a time constant give all of its
numbers.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from swashplate.identification.frequency.linear_start import by_regression
from swashplate.identification.responses.frequency_response import FrequencyResponse
from swashplate.models.linear.composition import PREFIX, nonsense, parts_of
from swashplate.models.linear.state_space import StateSpaceModel
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
        words = "regression on the core" + (f", tip-path plane of {lag:g} s" if flaps else "")
        starts[words] = model.with_values({n: _within(model, n, v) for n, v in values.items() if n in model.free})
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
        own = [f"tau_{SHORT[name]}" for name, servo in SERVO.items() if servo == lag and f"tau_{SHORT[name]}" in known]
        values[lag] = min((known[lag], *(known[name] for name in own)))
        values |= {name: known[name] - values[lag] for name in own}
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
