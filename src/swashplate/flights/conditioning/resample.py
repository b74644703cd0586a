"""From jittered stamps at several rates to one uniform rate: gaps are bridged up to a stated length, or split."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import xarray as xr

from swashplate.arrays import Array
from swashplate.errors import FlightError
from swashplate.flights.conditioning.attitude import interpolate
from swashplate.flights.conditioning.filters import filtered, shortest
from swashplate.flights.flight import Flight, stream
from swashplate.flights.schema import ATTITUDE, LOGGED_UNIT, POSITION, QUATERNION

Interval = tuple[float, float]
_FASTER = 1.02  # how much faster than the new rate a stream is that needs a filter: more than its stamps' jitter
ANTI_ALIAS = 0.4  # of the new rate: leaves the filter a tenth of the rate to fall before half the rate


def straightened(time: Array, *, width: int = 75) -> Array:
    """Stamps with their jitter smoothed away: a robust local line of stamp against sample count, shape (n,).

    Only for logs whose samples were taken regularly and stamped irregularly. A stamp that lies more than half a period
    off that line belongs to a real gap or a late sample; the runs between gaps are straightened each by itself.

    Args:
        time: strictly increasing stamps [s].
        width: samples each side of the running mean.
    """
    steps = np.diff(time)
    period = float(np.median(steps))
    starts = np.concatenate([[0], np.flatnonzero(steps > 1.5 * period) + 1, [time.size]])
    out = time.copy()
    for first, last in pairwise(starts.tolist()):
        if last - first < 5:
            continue
        count = np.arange(last - first)
        ideal = time[first] + period * count
        error = time[first:last] - ideal
        slope, level = np.polyfit(count, error, 1)
        rest = error - slope * count - level
        half = min(width, (last - first) // 2)
        kernel = np.ones(2 * half + 1)
        smooth = np.convolve(rest, kernel, "same") / np.convolve(np.ones_like(rest), kernel, "same")
        out[first:last] = ideal + slope * count + level + smooth
    return out if np.all(np.diff(out) > 0) else time


_SLOWEST = 0.75  # Hz: a log with fewer samples a second is one whose time is in milliseconds

METHODS = ("linear", "pchip", "spline")
_QUINTIC = 5
_SAME = 1e-10
"""s: closer stamps are the same."""

_HOLE = 1.5
"""Steps of a pose's own stream, or of the new rate, that leave no sample of the new rate without a reading near it."""

_OWN_STEPS = 2.5
"""Steps of a stream's own that are never a gap: one sample may go missing from a slow channel."""


def unbroken(time: Array, *, max_gap: float) -> list[Interval]:
    """Intervals (first stamp, last stamp) [s] between which no step exceeds `max_gap` [s]."""
    if time.size == 0:
        return []
    breaks = np.flatnonzero(np.diff(time) > max_gap)
    starts = np.concatenate([[0], breaks + 1])
    stops = np.concatenate([breaks, [time.size - 1]])
    return [(float(time[a]), float(time[b])) for a, b in zip(starts, stops, strict=True)]


def common(one: list[Interval], other: list[Interval]) -> list[Interval]:
    """The intersection of two ordered lists of intervals [s]."""
    pieces = [(max(a, c), min(b, d)) for a, b in one for c, d in other]
    return sorted((start, stop) for start, stop in pieces if stop > start)


def values_at(time: Array, values: Array, grid: Array, method: str) -> Array:
    """Samples of an unbroken run at the times `grid`.

    A quintic spline keeps a sine of a third of the sample rate within 0.2 dB (lines: 3 dB; Unser 1999, box 2).
    """
    if method not in ("spline", "pchip"):
        return np.interp(grid, time, values)
    at = np.minimum(np.searchsorted(time, grid - _SAME), time.size - 1)
    if np.all(np.abs(time[at] - grid) <= _SAME):
        return values[at]  # the samples themselves, without a third of a second for importing splines
    from scipy.interpolate import PchipInterpolator, make_interp_spline

    if method == "spline" and time.size > _QUINTIC:
        return np.asarray(make_interp_spline(time, values, k=_QUINTIC)(grid))
    return np.asarray(PchipInterpolator(time, values)(grid))


def _at(data: xr.Dataset, grid: Array, method: str, *, max_gap: float) -> dict[str, Array]:
    """Every channel of a stream at the times `grid`, which lie in one of its unbroken runs."""
    time = np.asarray(data["time"].values, dtype=np.float64)
    runs = unbroken(time, max_gap=max(max_gap, _OWN_STEPS * float(np.median(np.diff(time)))))
    first, last = next((run for run in runs if run[0] <= grid[0] <= run[1]), (time[0], time[-1]))
    inside = (time >= first) & (time <= last)
    time = time[inside]
    values = {str(name): np.asarray(v.values, dtype=np.float64)[inside] for name, v in data.data_vars.items()}
    out: dict[str, Array] = {}
    if all(name in values for name in QUATERNION):
        q = interpolate(time, np.stack([values.pop(name) for name in QUATERNION], axis=-1), grid)
        out.update(zip(QUATERNION, q.T, strict=True))
    for name, samples in values.items():
        if not np.isfinite(samples).all():
            raise FlightError(
                f"{int((~np.isfinite(samples)).sum())} of {samples.size} samples are NaN or infinite.",
                channel=name,
                hint="Condition with outliers=True: it drops them and counts them.",
            )
        # NED yaw and roll wrap at half a turn; an interpolation across the wrap would invent a fast turn.
        smooth = np.unwrap(samples) if name in ("phi", "psi") else samples
        out[name] = values_at(time, smooth, grid, method)
    return out


def _rate(data: xr.Dataset) -> float:
    return 1.0 / float(np.median(np.diff(data["time"].values)))


def _pieces(flight: Flight, max_gap: float) -> list[Interval]:
    pieces: list[Interval] | None = [] if not flight.streams else None
    for data in flight.streams.values():
        time = np.asarray(data["time"].values, dtype=np.float64)
        # A slow stream (a battery voltage at 10 Hz) has no gap between two of its own samples.
        native = _OWN_STEPS * float(np.median(np.diff(time)))
        here = unbroken(time, max_gap=max(max_gap, native))
        pieces = here if pieces is None else common(pieces, here)
    intervals = pieces or []
    return common(intervals, list(flight.segments)) if flight.segments else intervals


def _bridges(flight: Flight, pieces: list[Interval], *, rate: float, margin: float) -> list[Interval]:
    """Stretches inside the pieces in which the pose was not seen for so long that samples there are lines, no readings.

    Args:
        rate: of the new samples [Hz]. margin: how far a filter carries such a line to either side [s].
    """
    bridges = []
    for data in flight.streams.values():
        if {str(name) for name in data.data_vars} & {*POSITION, *ATTITUDE, *QUATERNION}:
            time = np.asarray(data["time"].values, dtype=np.float64)
            steps = np.diff(time)
            holes = np.flatnonzero(steps > _HOLE * max(float(np.median(steps)), 1.0 / rate))
            bridges += [(float(time[k]), float(time[k + 1])) for k in holes]
    inside = [hole for hole in sorted(bridges) if any(a <= hole[0] and hole[1] <= b for a, b in pieces)]
    return [(first - margin, last + margin) for first, last in inside]


def _check(flight: Flight, *, rate: float, max_gap: float, method: str) -> None:
    where = flight.provenance.source or None
    if not (rate > 0 and max_gap > 0) or method not in METHODS:
        raise FlightError(
            f"cannot resample with rate={rate}, max_gap={max_gap}, method='{method}'; expected positive numbers and "
            "'linear', 'pchip' or 'spline'.",
            where=where,
        )
    for name, data in flight.streams.items():
        if data.sizes["time"] < 2:
            raise FlightError(
                f"stream '{name}' has {data.sizes['time']} sample(s), expected at least 2.",
                where=where,
                channel=str(next(iter(data.data_vars), name)),
                hint="Check the log: a flight needs seconds of data.",
            )
    slow = max((_rate(data) for data in flight.streams.values()), default=_SLOWEST)
    if slow < _SLOWEST:
        raise FlightError(
            f"its time steps are {1.0 / slow:.4g} s, expected well below a second: wrong units.",
            where=where,
            channel="time",
            hint="Give --unit time=ms (in Python units={'time': 'ms'}) if it is logged in milliseconds.",
        )


def resample(
    flight: Flight,
    *,
    rate: float = 100.0,
    max_gap: float = 0.06,
    shortest_piece: float = 1.0,
    method: str = "linear",
    straighten: bool = False,
) -> Flight:
    """All streams as one stream "uniform" at `rate`, on the grid start + k / rate.

    Where the new rate is below a native one, the channels are interpolated at a whole multiple of the new rate first,
    low-passed without phase at 0.4 of the new rate, and then thinned out: nothing folds back into the band.

    Args:
        flight: streams at native stamps.
        rate: [Hz].
        max_gap: longest step between samples [s] that is interpolated; a longer one splits the flight. A stream slower
            than that is allowed 2.5 of its own steps.
        shortest_piece: pieces below this [s] are dropped and recorded.
        method: "linear", "pchip" or "spline" (quintic: keeps what is fast, rings at steps); attitude always goes by
            slerp.
        straighten: smooth the jitter of the stamps first (regular samples with irregular stamps only).

    Raises:
        FlightError: no piece is long enough, a channel holds NaN, or the rate makes no sense.
    """
    _check(flight, rate=rate, max_gap=max_gap, method=method)
    if straighten:
        flight = flight.with_streams(
            {n: d.assign_coords(time=straightened(np.asarray(d["time"].values))) for n, d in flight.streams.items()}
        )
    native = max(_rate(data) for data in flight.streams.values())
    factor = int(np.ceil(native / rate - 1e-6)) if native > _FASTER * rate else 1
    fine = rate * factor
    needed = max(shortest_piece, shortest(4) / fine if factor > 1 else 0.0)
    pieces = _pieces(flight, max_gap)
    kept = [piece for piece in pieces if piece[1] - piece[0] >= needed]
    if not kept:
        longest_found = max((b - a for a, b in pieces), default=0.0)
        raise FlightError(
            f"the longest piece without a gap above {max_gap} s lasts {longest_found:.3f} s, expected at least "
            f"{needed:.3f} s.",
            where=flight.provenance.source or None,
            hint="Record a longer flight."
            if len(pieces) < 2
            else "Record a longer flight with fewer gaps, or bridge longer ones (in Python condition(max_gap=...)).",
        )
    start = flight.start
    times: list[Array] = []
    columns: list[dict[str, Array]] = []
    segments: list[Interval] = []
    for first, last in kept:
        # Whole grid steps inside the piece; the small allowance keeps a grid point that equals an end but for rounding.
        k = np.arange(np.ceil((first - start) * rate - 1e-6), np.floor((last - start) * rate + 1e-6) + 1)
        coarse = start + k / rate
        grid = coarse[0] + np.arange((k.size - 1) * factor + 1) / fine
        here: dict[str, Array] = {}
        for data in flight.streams.values():
            if _rate(data) > _FASTER * rate:
                raw = _at(data, grid, method, max_gap=max_gap)
                here |= {n: filtered(v, rate=fine, cutoff=ANTI_ALIAS * rate, order=4)[::factor] for n, v in raw.items()}
            else:
                # Lines between slow samples are no signal of the fine grid: a filter would take them for one and shrink
                # what is real (measured: 1.6 % of an input at 8 Hz, for 100 Hz commands beside 200 Hz motion).
                here |= _at(data, coarse, method, max_gap=max_gap)
        times.append(coarse)
        columns.append(here)
        segments.append((float(coarse[0]), float(coarse[-1])))
    units = {str(n): str(v.attrs.get("units", "")) for d in flight.streams.values() for n, v in d.data_vars.items()}
    uniform = stream(
        np.concatenate(times), {name: np.concatenate([c[name] for c in columns]) for name in columns[0]}, units
    )
    for data in flight.streams.values():
        for name, values in data.data_vars.items():
            if LOGGED_UNIT in values.attrs:
                uniform[name].attrs[LOGGED_UNIT] = values.attrs[LOGGED_UNIT]
    dropped = [list(piece) for piece in pieces if piece not in kept]
    resampled = replace(flight, streams={"uniform": uniform}, segments=tuple(segments))
    return resampled.done(
        "resample",
        rate=rate,
        max_gap=max_gap,
        shortest_piece=shortest_piece,
        method=method,
        straighten=straighten,
        native_rate=round(native, 3),
        slower={
            str(name): round(_rate(data), 3)
            for data in flight.streams.values()
            if _FASTER * _rate(data) < rate
            for name in data.data_vars
        },
        anti_alias=ANTI_ALIAS * rate if factor > 1 else None,
        segments=len(segments),
        bridged=[list(hole) for hole in _bridges(flight, kept, rate=rate, margin=1.0 / rate if factor > 1 else 0.0)],
        dropped_pieces=dropped,
        dropped_seconds=round(sum(b - a for a, b in dropped), 3),
    )
