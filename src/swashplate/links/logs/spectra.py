"""A channel's spectra as the page draws them: density, spectrogram in decibels, and the rotor's harmonics."""

from __future__ import annotations

from typing import Any

import numpy as np

from swashplate.arrays import Array
from swashplate.errors import FlightError
from swashplate.links.logs import code_lines
from swashplate.links.logs.opened import Opened

_FLOOR = 70.0  # dB below the highest: what is darker is drawn alike
_ROWS, _COLUMNS = 160, 240


def spectra(opened: Opened, channel: str, start: float, stop: float) -> dict[str, Any]:
    """Of a channel between two times [s].

    Raises:
        FlightError: where the log lacks the channel, or has too few samples there.
    """
    from swashplate.flights.spectrum import harmonics, spectrogram, spectrum

    flight = opened.ready
    measured = spectrum(flight, channel, start=start, stop=stop)
    over = spectrogram(flight, channel, start=start, stop=stop, frames=_COLUMNS)
    picture = _pooled(over.density, _ROWS, _COLUMNS)
    level = 10.0 * np.log10(np.maximum(picture, np.finfo(np.float64).tiny))
    top = float(level.max())
    shade = np.clip(1.0 + (level - top) / _FLOOR, 0.0, 1.0)
    rotor: dict[str, Any] | None
    try:
        shaken = harmonics(flight, channel, start=start, stop=stop)
        rotor = {
            "channel": shaken.rotor,
            "speed": shaken.speed,
            "words": shaken.summary,
            "harmonics": [vars(harmonic) for harmonic in shaken.harmonics],
            "notches": {
                "words": shaken.about_notches,
                "parameters": shaken.notches.parameters if shaken.notches else {},
            },
        }
    except FlightError as error:
        rotor = {"channel": "", "speed": None, "words": f"{error.problem} {error.hint or ''}", "harmonics": []}
    return {
        "channel": channel,
        "unit": measured.unit,
        "words": str(measured),
        "frequency": measured.frequency[1:],
        "density": np.maximum(measured.density[1:], np.finfo(np.float64).tiny),
        "picture": {
            "time": [float(over.time[0]), float(over.time[-1])],
            "frequency": [float(over.frequency[0]), float(over.frequency[-1])],
            "shade": np.round(255.0 * shade).astype(int),
            "top": top,
            "floor": top - _FLOOR,
        },
        "rotor": rotor,
        "code": code_lines.spectra(opened.read, channel, start, stop, rotor=rotor["speed"] is not None).to_document(),
    }


def _pooled(density: Array, rows: int, columns: int) -> Array:
    """The highest density of each field of a grid of at most rows by columns."""
    for axis, most in ((0, rows), (1, columns)):
        n = density.shape[axis]
        if n > most:
            density = np.maximum.reduceat(density, np.unique(np.linspace(0, n, most, endpoint=False, dtype=int)), axis)
    return density
