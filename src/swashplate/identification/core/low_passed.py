"""Data that were low-passed before a fit: refused where the history says so, found in the spectra where it does not.

A likelihood whose sensor noise is white takes what a low-pass left, smooth noise, for motion: it believes every sample,
its noise estimates go to zero and its parameters go anywhere (a linkage of 0.41 in place of 0.21, with bounds of 0.02).
Frequency responses may be made from such data: the same filter on inputs and outputs cancels in them.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from swashplate.arrays import Array
from swashplate.errors import FlightError
from swashplate.filtering.disturbances import Noise
from swashplate.flights.averaged_spectra import power_density
from swashplate.flights.conditioning.resample import ANTI_ALIAS
from swashplate.flights.flight import Flight
from swashplate.identification.core.records import Record

_LOW, _HIGH = (0.15, 0.3), (0.5, 0.7)
"""Parts of half the sample rate: above most motion, and below the filter that resampling needs (0.8)."""

_FALL = 20.0
"""dB from the lower to the upper part. White noise makes 0; the tracked flights at hand fall by 3 to 13, low-passed at
a quarter of their rate by 23 to 35, with lower corners by 26 to 79 (26 is the window's own fall)."""

_SEGMENT = 256  # samples of a spectrum
_TOO_GOOD = {"sensor_position": (1e-6, "m"), "sensor_angle": (1e-5, "rad")}
"""Noise per sample that no tracking system reaches, a hundredth of the best."""


def refuse_lowpassed(flights: Iterable[Flight]) -> None:
    """Refuses flights whose history has a low-pass well below half of their present rate.

    Raises:
        FlightError: naming the filter, its corner and what to do.
    """
    for flight in flights:
        for step in flight.history:
            corner = float(step.details.get("cutoff") or np.inf)
            rate = flight.rate(flight.channels[0])
            if step.operation == "lowpass" and corner < ANTI_ALIAS * rate * (1.0 - 1e-6):
                raise FlightError(
                    f"its history has a low-pass at {corner:g} Hz (order {step.details.get('order', 4)}), and it has "
                    f"{rate:g} samples a second: a fit in time takes its sensor noise for white up to {rate / 2:g} Hz, "
                    "and would give wrong numbers with small bounds.",
                    where=flight.provenance.source or None,
                    hint="Condition with cutoff=0 (in a recorder's calibration: cutoff = 0 in [filter]), the noise is "
                    f"modelled; or bring it to at most {corner / ANTI_ALIAS:.3g} Hz. Frequency responses may be made "
                    "from it as it is.",
                )


def without_floor(values: Array) -> float:
    """By how much [dB] a channel's spectrum falls from 0.15-0.3 to 0.5-0.7 of half the sample rate."""
    frequency, power = power_density(values - values.mean(), rate=1.0, window=min(_SEGMENT, values.size), line=True)
    part = 2.0 * frequency
    low, high = (float(np.median(power[(part >= a) & (part <= b)])) for a, b in (_LOW, _HIGH))
    tiny = np.finfo(np.float64).tiny
    return float(10.0 * np.log10((low + tiny) / (high + tiny)))


def smoothed_outputs(pieces: Sequence[Record], flights: Sequence[Flight]) -> list[str]:
    """What is wrong with the outputs' spectra, in words: most of them fall away as only low-passed data do.

    Simulations are not judged: they may have no noise at all, and their history is known.
    """
    if all(flight.provenance.simulated for flight in flights):
        return []
    problems = []
    for piece in pieces:
        falls = {n: without_floor(piece.outputs[:, i]) for i, n in enumerate(piece.output_names)}
        smooth = [name for name, fall in falls.items() if fall > _FALL]
        if 2 * len(smooth) > len(falls):
            problems.append(
                f"{piece.name}: the spectra of {', '.join(smooth)} fall by {min(falls[n] for n in smooth):.0f} dB and "
                "more towards half the sample rate, and sensor noise does not: they were low-passed before they were "
                "logged or exported. Their noise is not white, and the fit's numbers must not be used; export "
                "unfiltered data, or condition to a lower rate"
            )
    return problems


def noise_too_small(noise: Noise | None, flights: Sequence[Flight]) -> list[str]:
    """What is wrong with the noise that a fit found, in words: no sensor is that good."""
    if noise is None or all(flight.provenance.simulated for flight in flights):
        return []
    return [
        f"{name} = {float(getattr(noise, name)):.1g} {unit} per sample: no sensor is that good, so the data were "
        "smoothed before, and the fit's numbers must not be used; fit unfiltered data"
        for name, (least, unit) in _TOO_GOOD.items()
        if float(getattr(noise, name)) < least
    ]
