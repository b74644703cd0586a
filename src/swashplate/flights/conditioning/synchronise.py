"""Two logs of one flight on one clock, by the motion that both have seen.

Coarse by cross-correlation, then least squares for offset and drift, with standard errors that count the colour of the
residuals. Paper A did it by hand: 100 Hz on board against 200 Hz motion capture (Fankhauser et al., sec. V).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import xarray as xr

from swashplate.arrays import Array
from swashplate.errors import FlightError
from swashplate.flights.conditioning.filters import filtered
from swashplate.flights.conditioning.reconstruction import coloured_covariance
from swashplate.flights.flight import Flight
from swashplate.flights.schema import ATTITUDE, RATES

_PASSES = 12
_AGREE = 0.5  # correlation of the matched motion below which the logs do not show the same flight


@dataclass(frozen=True)
class Synchronisation:
    """The second log's clock on the first's: t_first = offset + (1 + drift) * t_second.

    Attributes:
        offset: [s], at t_second = 0.
        drift: dimensionless; 50e-6 is 50 ppm.
        offset_sigma: standard error [s].
        drift_sigma: standard error.
        centre: t_second [s] at which offset and drift are independent.
        centre_sigma: standard error of the clock difference there [s].
        correlation: of the matched motion, mean over the channels.
        channels: what was matched.
    """

    offset: float
    drift: float
    offset_sigma: float
    drift_sigma: float
    centre: float
    centre_sigma: float
    correlation: float
    channels: tuple[str, ...]

    def to_first(self, time: Array) -> Array:
        """Times of the second clock [s] on the first."""
        return np.asarray(self.offset + (1.0 + self.drift) * np.asarray(time, dtype=np.float64))

    def __str__(self) -> str:
        return (
            f"offset {self.offset:.4f} ± {self.offset_sigma:.4f} s, drift {1e6 * self.drift:.1f} ± "
            f"{1e6 * self.drift_sigma:.1f} ppm (correlation {self.correlation:.3f} of {', '.join(self.channels)})"
        )


def _shared(first: Flight, second: Flight) -> tuple[str, ...]:
    for names in (RATES, ATTITUDE):
        both = tuple(name for name in names if name in first and name in second)
        if both:
            return both
    raise FlightError(
        f"the two logs share no motion: the first has {', '.join(first.channels)}, the second "
        f"{', '.join(second.channels)}.",
        where=second.provenance.source or None,
        hint=f"Derive {', '.join(RATES)} or {', '.join(ATTITUDE)} in both, or name the channels to match.",
    )


def _smooth(flight: Flight, names: Sequence[str], *, rate: float, band: float) -> tuple[Array, Array]:
    """The channels at `rate` on one grid, low-passed: then a spline between samples adds nothing of its own."""
    from scipy.interpolate import CubicSpline

    start = max(float(flight.time(name)[0]) for name in names)
    stop = min(float(flight.time(name)[-1]) for name in names)
    grid = start + np.arange(int((stop - start) * rate + 1e-6) + 1) / rate
    columns = []
    for name in names:
        values = flight.values(name)
        if not np.isfinite(values).all() or not np.ptp(values) > 0:
            raise FlightError(
                "is constant or not finite, so no clock can be matched by it.",
                where=flight.provenance.source or None,
                channel=name,
            )
        full = np.unwrap(values) if name in ("phi", "psi") else values
        columns.append(np.asarray(CubicSpline(flight.time(name), full)(grid)))
    return grid, filtered(np.stack(columns, axis=-1), rate=rate, cutoff=band)


def _coarse(one: Array, two: Array, *, rate: float) -> float:
    """Delay of the second record's samples against the first's [s] by cross-correlation, channels summed."""
    from scipy.signal import correlate, correlation_lags

    total = np.zeros(one.shape[0] + two.shape[0] - 1)
    for a, b in zip(one.T, two.T, strict=True):
        total += correlate((a - a.mean()) / a.std(), (b - b.mean()) / b.std(), mode="full", method="fft")
    lags = correlation_lags(one.shape[0], two.shape[0], mode="full")
    return float(lags[int(np.argmax(total))]) / rate


def synchronise(
    first: Flight, second: Flight, *, channels: Sequence[str] | None = None, band: float = 8.0
) -> Synchronisation:
    """Offset and drift of the second log's clock against the first's, with standard errors.

    Args:
        first: whose clock is kept.
        second: whose clock is matched.
        channels: what to match; None takes the rates, or else the angles, that both logs have. Constant differences
            between the logs are allowed for.
        band: low-pass on both [Hz].

    Raises:
        FlightError: no shared motion, too little overlap, or motions that do not agree.
    """
    from scipy.interpolate import CubicSpline

    names = tuple(channels) if channels else _shared(first, second)
    rate = max(first.rate(names[0]), second.rate(names[0]))
    time, one = _smooth(first, names, rate=rate, band=band)
    time_two, two = _smooth(second, names, rate=rate, band=band)
    spline, slope = CubicSpline(time_two, two), CubicSpline(time_two, two).derivative()
    centre = 0.5 * float(time_two[0] + time_two[-1])
    # t_first = at_centre + (1 + drift) (t_second - centre): the two are then nearly independent.
    at_centre = float(time[0] - time_two[0]) + _coarse(one, two, rate=rate) + centre
    drift = 0.0
    edge = 1.0 / band  # the filters' ends
    for _ in range(_PASSES):
        second_time = centre + (time - at_centre) / (1.0 + drift)
        inside = (second_time > time_two[0] + edge) & (second_time < time_two[-1] - edge)
        inside &= (time > time[0] + edge) & (time < time[-1] - edge)
        if inside.sum() < 2.0 * rate:
            raise FlightError(
                f"the logs overlap by {inside.sum() / rate:.2f} s, expected at least 2 s.",
                where=second.provenance.source or None,
                hint="Check that both logs are of the same flight.",
            )
        at = second_time[inside]
        residual = one[inside] - spline(at)
        residual = residual - residual.mean(axis=0)
        weight = 1.0 / np.maximum(residual.std(axis=0), 1e-12)
        moving = slope(at)
        pieces = []
        for k in range(len(names)):
            s = np.column_stack([-moving[:, k], -moving[:, k] * (at - centre)]) / (1.0 + drift)
            pieces.append(((s - s.mean(axis=0)) * weight[k], residual[:, k] * weight[k]))
        normal = np.asarray(sum(s.T @ s for s, _ in pieces))
        step = np.linalg.solve(normal, np.asarray(sum(s.T @ r for s, r in pieces)))
        at_centre, drift = at_centre + float(step[0]), drift + float(step[1])
        if abs(step[0]) < 1e-9 and abs(step[1]) < 1e-11:
            break
    match = [float(np.corrcoef(one[inside][:, k], spline(at)[:, k])[0, 1]) for k in range(len(names))]
    if np.mean(match) < _AGREE:
        raise FlightError(
            f"the motions agree with a correlation of {np.mean(match):.2f} only, expected at least {_AGREE}.",
            where=second.provenance.source or None,
            hint="Check that both logs are of the same flight, and their axes and signs.",
        )
    covariance = coloured_covariance(pieces, lag=round(rate))
    to_zero = np.array([1.0, -centre])  # offset = at_centre - (1 + drift) centre
    return Synchronisation(
        offset=at_centre - (1.0 + drift) * centre,
        drift=drift,
        offset_sigma=float(np.sqrt(to_zero @ covariance @ to_zero)),
        drift_sigma=float(np.sqrt(covariance[1, 1])),
        centre=centre,
        centre_sigma=float(np.sqrt(covariance[0, 0])),
        correlation=float(np.mean(match)),
        channels=names,
    )


def merge(first: Flight, second: Flight, *, clock: Synchronisation) -> Flight:
    """The first flight with the second's further channels on the first's clock; shared channels stay the first's.

    Args:
        first: whose clock and provenance are kept.
        second: what is added, in streams named as there (with "second_" in front where the name is taken).
        clock: from `synchronise`.
    """
    streams: dict[str, xr.Dataset] = dict(first.streams)
    added: list[str] = []
    for name, data in second.streams.items():
        new = [str(c) for c in data.data_vars if str(c) not in first]
        if new:
            stamps = clock.to_first(np.asarray(data["time"].values))
            kept = data[new].assign_coords(time=("time", stamps, {"units": "s"}))
            streams[f"second_{name}" if name in streams else name] = kept
            added += new
    return replace(first, streams=streams).done(
        "merge",
        source=second.provenance.source,
        sha256=second.provenance.sha256,
        offset=clock.offset,
        drift=clock.drift,
        offset_sigma=clock.offset_sigma,
        drift_sigma=clock.drift_sigma,
        added=added,
    )
