"""Zero-phase Butterworth filters, the same for every channel, segment by segment; signals without their line."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from swashplate.arrays import Array
from swashplate.errors import FlightError
from swashplate.flights.conditioning.attitude import continuous
from swashplate.flights.flight import Flight
from swashplate.flights.schema import QUATERNION
from swashplate.flights.storage import timed


def butterworth_sections(order: int, corners: Array, *, rate: float) -> Array:
    """Sections (n, 6) of a Butterworth filter by the bilinear transform: b0, b1, b2, a0 = 1, a1, a2.

    What `scipy.signal` has, without the half second of loading it.
    Oppenheim and Schafer 2010, sec. 7.2 and 7.3.

    Args:
        order: of the low-pass; a band-pass has twice as many poles.
        corners: [Hz], one of a low-pass or two of a band-pass, between zero and half the rate.
        rate: sample rate [Hz].
    """
    warped = np.tan(np.pi * corners / rate)
    poles = np.exp(1j * np.pi * (np.arange(order) * 2 + order + 1) / (2 * order))
    band = corners.size == 2
    middle = float(np.sqrt(warped.prod())) if band else 0.0
    if band:
        half = 0.5 * (warped[1] - warped[0]) * poles
        apart = np.sqrt(half**2 - middle**2)
        poles = np.concatenate([half + apart, half - apart])
    else:
        poles = poles * warped[0]
    poles = (1.0 + poles) / (1.0 - poles)
    real = np.sort(poles[np.abs(poles.imag) < 1e-12].real)
    ends = [(-2.0 * p.real, float(abs(p)) ** 2) for p in poles[poles.imag >= 1e-12]]
    ends += [(-(p + q), p * q) for p, q in real[: real.size // 2 * 2].reshape(-1, 2)]
    sections = [[1.0, 0.0, -1.0, 1.0, *end] if band else [1.0, 2.0, 1.0, 1.0, *end] for end in ends]
    sections += [[1.0, 1.0, 0.0, 1.0, -p, 0.0] for p in real[real.size // 2 * 2 :]]
    cascade = np.array(sections)
    here = (1.0 + 1j * middle) / (1.0 - 1j * middle)  # where the gain is one: a low-pass's is at rest
    powers = here ** -np.arange(3)
    cascade[:, :3] *= np.abs((cascade[:, 3:] @ powers) / (cascade[:, :3] @ powers))[:, None]
    return cascade


def both_ways(sections: Array, values: Array, *, padding: int) -> Array:
    """Values (n, ...) after the sections forwards and backwards, begun as if their first had always been.

    Args:
        sections: of `butterworth_sections`.
        padding: samples by which both ends go on, turned about the last one (Gustafsson 1996, IEEE Trans. Signal
            Processing 44, 988-992, on what ends do); fewer than n.
    """
    before, after = values[padding:0:-1], values[-2 : -padding - 2 : -1]
    long = np.concatenate([2.0 * values[:1] - before, values, 2.0 * values[-1:] - after])
    for _ in range(2):
        long = _forwards(sections, long)[::-1]
    return np.array(long[padding : padding + len(values)])


def _forwards(sections: Array, values: Array) -> Array:
    """Values after the sections; recursions are systems of equations with a band, solved from the first row on."""
    from scipy.linalg.lapack import dtbtrs  # slow to import; `inspect` does without

    rest = float(np.prod(sections[:, :3].sum(axis=1) / sections[:, 3:].sum(axis=1)))
    driven = (values - values[:1]).reshape(len(values), -1)
    for b0, b1, b2, *poles in sections:
        reached = b0 * driven
        reached[1:] += b1 * driven[:-1]
        reached[2:] += b2 * driven[:-2]
        driven, _ = dtbtrs(np.repeat(np.array(poles)[:, None], len(values), axis=1), reached, uplo="L", diag="U")
    return np.asarray(driven.reshape(values.shape) + rest * values[:1], dtype=np.float64)


def shortest(order: int, *, band: bool = False) -> int:
    """Fewest samples that a filter of this order takes: three times its memory, and one."""
    sections = order if band else (order + 1) // 2
    at_origin = 0 if band or order % 2 == 0 else 1
    return 3 * (2 * sections + 1 - at_origin) + 1


def filtered(values: Array, *, rate: float, cutoff: float | tuple[float, float], order: int = 4) -> Array:
    """A uniform record after a Butterworth filter run forwards and backwards: no phase, twice the order's slope.

    Args:
        values: shape (n,) or (n, m), filtered along the first axis.
        rate: sample rate [Hz].
        cutoff: corner of a low-pass, or the two corners of a band-pass [Hz] (-6 dB there, as it runs twice).
        order: of one pass.

    Raises:
        FlightError: the corner is not below half the rate, or the record is too short.
    """
    band = isinstance(cutoff, tuple)
    corners = np.atleast_1d(np.asarray(cutoff, dtype=np.float64))
    if not (np.all(corners > 0) and np.all(corners < rate / 2) and np.all(np.diff(corners) > 0)):
        raise FlightError(
            f"a filter corner of {corners.tolist()} Hz does not fit a rate of {rate:g} Hz: expected 0 < corner < "
            f"{rate / 2:g} Hz.",
            hint="Lower the cutoff or raise the rate.",
        )
    needed = shortest(order, band=band)
    if values.shape[0] < needed:
        raise FlightError(
            f"{values.shape[0]} samples ({values.shape[0] / rate:.3f} s) are too short for the filter, which needs "
            f"{needed} samples ({needed / rate:.3f} s) at {rate:g} Hz.",
            hint="Use a longer record, or condition with cutoff=0 (no filter).",
        )
    return both_ways(butterworth_sections(order, corners, rate=rate), values, padding=needed - 1)


def within(values: Array, *, rate: float, band: tuple[float, float]) -> Array:
    """What of a uniform record lies in a band: a second-order Butterworth band-pass run both ways, by its spectrum.

    It is `filtered` for looking at a log; they differ at the ends, where this one mirrors the record for a period of
    the lower corner.

    Args:
        values: shape (n,) or (n, m), along the first axis.
        rate: sample rate [Hz].
        band: corners [Hz], below half the rate (-6 dB there).
    """
    n = values.shape[0]
    pad = min(n - 1, int(np.ceil(rate / band[0])))
    long = np.concatenate([2.0 * values[:1] - values[pad:0:-1], values, 2.0 * values[-1:] - values[-2 : -2 - pad : -1]])
    low, high = np.tan(np.pi * np.asarray(band) / rate)
    warped = np.tan(np.pi * np.fft.rfftfreq(long.shape[0], 1.0 / rate) / rate)
    passed, detuned = (warped * (high - low)) ** 4, (warped**2 - low * high) ** 4
    gain = passed / (passed + detuned)
    spectrum = np.fft.rfft(long, axis=0) * gain.reshape(-1, *(1,) * (values.ndim - 1))
    return np.asarray(np.fft.irfft(spectrum, long.shape[0], axis=0)[pad : pad + n], dtype=np.float64)


def by_segment(flight: Flight, values: Array, apply: Callable[[Array], Array]) -> Array:
    """`apply` to each unbroken part of `values` (first axis: the one uniform stream's time), put together again."""
    (data,) = flight.streams.values()
    time = np.asarray(data["time"].values, dtype=np.float64)
    pieces = flight.segments or ((float(time[0]), float(time[-1])),)
    out = np.array(values, dtype=np.float64)
    for start, stop in pieces:
        # Half a microsecond: segment ends are stamps, but may have gone through a file.
        inside = (time >= start - 5e-7) & (time <= stop + 5e-7)
        out[inside] = apply(out[inside])
    return out


def uniform_rate(flight: Flight) -> float:
    """Rate [Hz] of a flight that is one uniform stream.

    Raises:
        FlightError: it has several streams, or fewer than two samples.
    """
    if len(flight.streams) != 1:
        raise FlightError(
            f"the flight has {len(flight.streams)} streams ({', '.join(flight.streams)}), expected one uniform stream.",
            where=flight.provenance.source or None,
            hint="Bring it to one rate with resample(flight, rate=...) first.",
        )
    return flight.rate(flight.channels[0])


def lowpass(flight: Flight, *, cutoff: float, order: int = 4) -> Flight:
    """Every channel alike, inputs too, through the same Butterworth low-pass, without phase.

    The same filter on inputs and outputs cancels in their relation: no parameter is shifted by it.

    Args:
        flight: one uniform stream.
        cutoff: corner [Hz].
        order: of one pass; it runs twice.

    Raises:
        FlightError: a segment is shorter than the filter needs, or than one period of its corner.
    """
    rate = uniform_rate(flight)
    ((name, data),) = flight.streams.items()
    briefest = min(stop - start for start, stop in flight.segments or ((flight.start, flight.stop),))
    if cutoff > 0 and briefest < 1.0 / cutoff:
        raise FlightError(
            f"a piece of {briefest:.3f} s is too short for a filter of {cutoff:g} Hz, expected at least one period "
            f"({1.0 / cutoff:.3f} s).",
            where=flight.provenance.source or None,
            hint="Raise the cutoff, use a longer record, or condition with cutoff=0 (no filter).",
        )
    values = {str(n): np.asarray(v.values, dtype=np.float64) for n, v in data.data_vars.items()}
    try:
        smooth = {
            n: by_segment(flight, v, lambda part: filtered(part, rate=rate, cutoff=cutoff, order=order))
            for n, v in values.items()
        }
    except FlightError as error:
        raise FlightError(error.problem, where=flight.provenance.source or None, hint=error.hint) from None
    if all(n in smooth for n in QUATERNION):
        # Components are filtered one by one; at the few degrees per filter time of a flight only their length suffers.
        unit = continuous(np.stack([smooth[n] for n in QUATERNION], axis=-1))
        smooth.update(zip(QUATERNION, unit.T, strict=True))
    smoothed = data.assign({n: timed(v, data[n].attrs) for n, v in smooth.items()})
    return flight.with_streams({name: smoothed}).done("lowpass", cutoff=cutoff, order=order, zero_phase=True)


def detrended(values: Array) -> Array:
    """Values less the straight line that fits them best, along the first axis; shape as given, (n,) or (n, m)."""
    ramp = np.linspace(-1.0, 1.0, len(values)) if len(values) > 1 else np.zeros(len(values))
    slope = (ramp @ values) / max(float(ramp @ ramp), 1e-300)
    line = np.multiply.outer(ramp, slope) + np.mean(values, axis=0)
    return np.asarray(values - line, dtype=np.float64)
