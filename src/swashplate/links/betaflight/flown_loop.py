"""What a rate loop of Betaflight was worth in a flight: read off the sweep of its stick in a log, with no model."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from swashplate.control.analysis.rate_gain_names import BETAFLIGHT, names_of
from swashplate.control.analysis.rate_loop import HALF_POWER, controller_response
from swashplate.errors import FlightError
from swashplate.flights.conditioning.uniform_records import uniform_records
from swashplate.flights.flight import Flight
from swashplate.identification.frequency.handling import margins
from swashplate.identification.responses.respond import respond

_RATE, _COHERENT = 200.0, 0.8
"""Hz of the records; coherence from which on a line counts."""


class FlownLoop(NamedTuple):
    """A rate loop as it flew; NaN for what the sweep's band does not hold.

    Attributes:
        missed: rms of the demanded rate that the rate did not follow, over the rms of the demand.
        crossover: [rad/s]. phase: margin [deg]. sensitivity: the largest |1 / (1 + L)|.
        rejection: up to where a disturbance is halved in power [rad/s].
        resonance: the largest rate per demanded rate [dB].
    """

    missed: float
    crossover: float
    phase: float
    sensitivity: float
    rejection: float
    resonance: float

    def summary(self) -> str:
        """In one line."""
        parts = (
            (f"misses {100.0 * self.missed:.0f} % of its demand", self.missed),
            (f"resonance {self.resonance:.1f} dB", self.resonance),
            (f"crossover {self.crossover:.1f} rad/s", self.crossover),
            (f"phase margin {self.phase:.0f} deg", self.phase),
            (f"largest sensitivity {self.sensitivity:.2f}", self.sensitivity),
            (f"rejects to {self.rejection:.1f} rad/s", self.rejection),
        )
        return ", ".join(text for text, value in parts if np.isfinite(value))


def flown_loop(piece: Flight, axis: str, *, band: tuple[float, float]) -> FlownLoop:
    """The loop of "roll", "pitch" or "yaw" from the piece of a log in which its stick was swept over a band [Hz].

    L is the measured response from the mixer's command to the rate, times the controller's with the gains and filters
    that the log's header tells. TPA and anti-gravity are not in it.

    Raises:
        FlightError: a header without gains (Betaflight 2025.12 and later have them).
    """
    title, command, stick = axis.capitalize(), f"mixer_{axis}", f"stick_{axis}"
    rate = BETAFLIGHT[title][0]
    gains = {name: piece.provenance.parameter(name) for name in names_of(title).values()}
    known = {name: float(value) for name, value in gains.items() if value is not None}
    if names_of(title)["P"] not in known:
        raise FlightError("the log's header has no gains of Betaflight: its loop cannot be judged.", channel=command)
    records = uniform_records([piece], (command, rate, f"{rate}_demand", stick), rate=_RATE)
    asked, followed = (np.concatenate([each.values(n) for each in records]) for n in (f"{rate}_demand", rate))
    missed = float(np.std(followed - asked) / np.std(asked))
    plant = respond(records, inputs=[command], outputs=[rate], references=(stick,), band=band)
    h, coherence, _ = plant.pair(rate, command)
    good = np.isfinite(h) & (coherence >= _COHERENT)
    omega, loop = plant.omega[good], h[good] * controller_response(known, plant.omega[good])
    read, left = margins(omega, loop), np.abs(1.0 / (1.0 + loop))
    crossed = np.isfinite(read.crossover.value)
    above = np.flatnonzero((left[:-1] < HALF_POWER) & (left[1:] >= HALF_POWER))
    closed = respond(records, inputs=[f"{rate}_demand"], outputs=[rate], references=(stick,), band=band)
    t, sure, _ = closed.pair(rate, f"{rate}_demand")
    t = t[np.isfinite(t) & (sure >= _COHERENT)]
    return FlownLoop(
        missed,
        read.crossover.value,
        read.phase_margin.value,
        float(left.max()) if crossed else np.nan,
        float(omega[above[0]]) if above.size else np.nan,
        float(20.0 * np.log10(np.abs(t).max())) if t.size else np.nan,
    )
