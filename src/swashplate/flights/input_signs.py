"""Which way each command of a log moves the aircraft, and whether its name promises the other way.

Only a command that something from outside moved is asked: what relates a controller's answer to the motion is the
controller. The response is the plain one of its own sweep, or of the whole log where it was moved otherwise.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from swashplate.arrays import Array, Complex
from swashplate.flights.channel_names import SET_POINT, STICK
from swashplate.flights.excitation import OUTSIDE, excitations, of_inputs
from swashplate.flights.flight import Flight
from swashplate.flights.maneuvers.sweeps import Sweep
from swashplate.flights.motion_signs import FEWEST, LINES, LOWEST, SIGNED, ResponseSign, sign_of
from swashplate.flights.readers.given_units import unit_to_give
from swashplate.flights.schema import axis_of
from swashplate.flights.senses import INTEGRATIONS, expected_sense, has_sense

_MOTIONS = (("p",), ("q",), ("r",), ("az", "w", "vz"))
"""What is asked of roll, pitch, yaw and climb: the first that the log has."""
_BESIDE = {"motor_lower": "motor_upper", "motor_upper": "motor_lower"}
"""Commands of which each makes two motions, and the other one's is taken away."""
_COHERENT, _WINDOW, _SHARE, _HIGHEST = 0.6, 8.0, 0.35, 10.0
"""Coherence of a line that counts, length of a window [s], and highest line: over the rate, and [Hz]."""
_AROUND = 1.0  # s about a sweep
_LOOPS = "a loop makes it and no sweep moved it (`swash respond` asks sticks and set-points too)"


def input_signs(flight: Flight, sweeps: Sequence[Sweep]) -> tuple[tuple[ResponseSign, str], ...]:
    """The signs of all commands whose names promise one, and why one is not told.

    Args:
        flight: as logged. sweeps: that were told or seen in it.
    """
    signs = []
    for name in flight.channels:
        if has_sense(name) and _moves(flight.values(name)):
            outputs = [next((n for n in kind if n in flight and expected_sense(n, name)), "") for kind in _MOTIONS]
            asked = [output for output in outputs if output]
            part, why = _moved(flight, name, sweeps, asked) if asked else (None, "")
            for output in asked:
                sign = ResponseSign(output, name, expected_sense(output, name), 0, 0.0, 0.0, (np.nan, np.nan), 0.0)
                signs.append((sign, why) if part is None else _judged(part, sign))
    return tuple(signs)


def sign_words(sign: ResponseSign, why: str) -> str:
    """One of them as a line."""
    if not sign.told:
        return f"{sign.input} to {sign.output}: not told, {why}"
    named = "NOT as its name says" if sign.wrong else "as its name says"
    return f"{sign.input} to {sign.output}: {SIGNED[sign.told]}, {named} ({sign.low:.2g}-{sign.high:.2g} Hz)"


def sign_problem(flight: Flight, sign: ResponseSign) -> str:
    """What is wrong with one whose sign is, and the remedy."""
    return sign.problem(unit_to_give(flight, sign.input, sign="-"))


def _moved(flight: Flight, name: str, sweeps: Sequence[Sweep], outputs: Sequence[str]) -> tuple[Flight | None, str]:
    """The part of a flight in which something from outside moved a command; or why there is none."""
    own = [s for s in sweeps if s.channel == name or (axis_of(name) and axis_of(name) in s.axis.split())]
    if own:
        longest = max(own, key=lambda s: s.stop - s.start)
        return flight.between(longest.start - _AROUND, longest.stop + _AROUND), ""
    if min(flight.time(n).size for n in (name, *outputs)) < 4 * FEWEST or flight.stop <= flight.start:
        return None, "the record is too short"
    if not name.startswith(STICK) and any(n.endswith(SET_POINT) for n in flight.channels):
        return None, _LOOPS
    moved = of_inputs(excitations(flight, (name,), outputs=outputs)).get(name)
    if moved is not None and moved.kind in OUTSIDE:
        return flight, ""
    return None, "nothing is known to have moved it from outside" if moved is None else moved.words.rstrip(".")


def _moves(values: Array) -> bool:
    finite = values[np.isfinite(values)]
    return bool(finite.size and np.ptp(finite) > 0.0)


def _judged(flight: Flight, sign: ResponseSign) -> tuple[ResponseSign, str]:
    beside = _BESIDE.get(sign.input, "")
    inputs = (sign.input, *([beside] if beside in flight else []))
    omega, h = _coherent_response(flight, inputs, sign.output)
    if omega.size < FEWEST:
        return sign, f"it moves {sign.output} coherently at too few lines"
    told, odds, misfit = sign_of(omega, h, integrations=INTEGRATIONS[sign.output])
    low, high = float(omega[0] / 2.0 / np.pi), float(omega[-1] / 2.0 / np.pi)
    sign = replace(sign, told=told, low=low, high=high, misfit=misfit, odds=odds)
    return sign, "" if told else sign.words


def _coherent_response(flight: Flight, inputs: Sequence[str], output: str) -> tuple[Array, Complex]:
    """Response of an output to the first of the inputs, the others held still, where it is coherent: [rad/s], H."""
    signals = [(flight.time(n), flight.values(n)) for n in (*inputs, output)]
    signals = [(time[np.isfinite(values)], values[np.isfinite(values)]) for time, values in signals]
    nothing = np.zeros(0), np.zeros(0, dtype=np.complex128)
    if min(time.size for time, _ in signals) < 4 * FEWEST:
        return nothing
    dt = max(float(np.median(np.diff(time))) for time, _ in signals)
    first, last = max(float(time[0]) for time, _ in signals), min(float(time[-1]) for time, _ in signals)
    grid = np.arange(first, last, dt)
    if grid.size < 4 * FEWEST:
        return nothing
    table = np.stack([np.interp(grid, time, values) for time, values in signals])
    length = int(min(grid.size / 2, max(_WINDOW / dt, 8 * FEWEST)))
    frequency = np.asarray(np.fft.rfftfreq(length, dt), dtype=np.float64)
    spectra = _cross_spectra(table, length, dt)
    lines = np.flatnonzero((2.0 * np.pi * frequency >= LOWEST) & (frequency <= min(_SHARE / dt, _HIGHEST)))
    if lines.size < FEWEST:
        return nothing
    spread = np.geomspace(float(frequency[lines[0]]), float(frequency[lines[-1]]), LINES)
    lines = lines[np.unique(np.searchsorted(frequency[lines], spread).clip(max=lines.size - 1))]
    spectra, k = spectra[lines], len(inputs)
    others = spectra[:, 1:k, 1:k] + 1e-12 * np.eye(k - 1)
    left = spectra[:, [0, k]][:, :, [0, k]]
    if k > 1:  # what the others explain is taken away
        left = left - spectra[:, [0, k], 1:k] @ np.linalg.solve(others, spectra[:, 1:k][:, :, [0, k]])
    own, cross, whole = left[:, 0, 0].real, left[:, 0, 1], left[:, 1, 1].real
    known = (own > 1e-6 * spectra[:, 0, 0].real) & (whole > 0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        known &= np.abs(cross) ** 2 / (own * whole) >= _COHERENT
        h = cross / own
    return 2.0 * np.pi * frequency[lines][known], h[known]


def _cross_spectra(table: Array, length: int, dt: float) -> Complex:
    """Densities of conj(a) b of signals (k, n) by Welch's method, (lines, k, k): Hann windows that overlap by half.

    Each is taken without its straight line. Not SciPy's, whose import takes as long as all else of an inspection.
    """
    pieces = np.lib.stride_tricks.sliding_window_view(table, length, axis=1)[:, :: length - length // 2]
    time = np.arange(length) - 0.5 * (length - 1)
    slope = pieces @ time / (time @ time)
    level = pieces - pieces.mean(axis=2, keepdims=True) - slope[..., None] * time
    window = 0.5 - 0.5 * np.cos(2.0 * np.pi * np.arange(length) / length)
    lines = np.fft.rfft(level * window, axis=2)
    power = np.einsum("anl,bnl->lab", lines.conj(), lines, optimize=True)
    return np.asarray(power * 2.0 * dt / (lines.shape[1] * np.sum(window**2)))
