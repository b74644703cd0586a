"""How far a model may miss a flight before a pilot can tell: envelopes of maximum unnoticeable added dynamics."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from swashplate.arrays import Array, Complex
from swashplate.identification.frequency.response_cost import Target, log_error

_BOUNDS = {
    # bound: numerator, denominator (falling powers of s), lead [s]
    "gain_high": ((3.16, 31.61, 22.79), (1.0, 27.14, 1.84), 0.0),
    "gain_low": ((0.0955, 9.92, 2.15), (1.0, 11.60, 4.95), 0.0),
    "phase_high": ((68.89, 1100.12, -275.22), (1.0, 39.94, 9.99), 0.0059),
    "phase_low": ((475.32, 184100.0, 29456.1), (1.0, 11.66, 0.0389), -0.0072),
}
"""MIL-HDBK-1797 (1997), the envelopes of Hodgkinson et al., as rational functions. Another program has the same ones
(C. Regan 2006, LoesBound.m: four digits, without the leads, unchecked there too); the leads are recalled. Neither was
held against the standard's text; the tests hold them against that copy and the envelopes' known shape."""


def envelopes(omega: Array) -> dict[str, Array]:
    """Bounds of model over flight: "gain_high", "gain_low" [dB], "phase_high", "phase_low" [deg], each of shape (n,).

    They were found for the pitch of fighter aircraft; on a small helicopter they are a measure, not a requirement.

    Args:
        omega: [rad/s].
    """
    s = 1j * np.asarray(omega, dtype=np.float64)
    bounds = {}
    for name, (top, bottom, lead) in _BOUNDS.items():
        h = np.polyval(top, s) / np.polyval(bottom, s) * np.exp(lead * s)
        bounds[name] = 20.0 * np.log10(np.abs(h)) if name.startswith("gain") else np.degrees(np.angle(h))
    return bounds


@dataclass(frozen=True)
class Mismatch:
    """Model over flight of one response.

    Attributes:
        target: the measured response.
        gain: error [dB]. phase: error [deg]. Shape (n,).
        inside: share of the points inside the envelopes.
    """

    target: Target
    gain: Array
    phase: Array
    inside: float


def mismatch(model: Complex, wanted: Target) -> Mismatch:
    """Model over flight at the points of the cost, held against the envelopes."""
    error = log_error(model, wanted.measured)
    gain, phase = 20.0 / np.log(10.0) * error.real, np.degrees(error.imag)
    bound = envelopes(wanted.omega)
    good = (gain <= bound["gain_high"]) & (gain >= bound["gain_low"])
    good &= (phase <= bound["phase_high"]) & (phase >= bound["phase_low"])
    return Mismatch(wanted, gain, phase, float(np.mean(good)))
