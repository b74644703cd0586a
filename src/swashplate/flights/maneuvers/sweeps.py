"""The frequency sweeps in a flight: where the log says so, and where a signal's frequency rises steadily.

In a signal a sweep is a ridge of its scalogram that only ever rises. The ridge is found by dynamic programming over
the share of the local power that each frequency holds (Carmona, Hwang and Torresani, 1998, ch. 7, with the constraint
that a path rises), so that noise and feedback beside the sweep count against it only as far as they are there.

Noise has rising ridges too. In noise of any spectrum that stays the same, a frequency holds its share of the power at
all times alike; a sweep visits each frequency once. So a ridge counts by its contrast: by how much more of the power
it holds at each of its frequencies than the same frequency usually holds, added up over octaves. What noise reaches is
counted in the tests, and `_CONTRAST` lies beyond it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from swashplate.arrays import Array, Complex
from swashplate.errors import FlightError
from swashplate.flights.conditioning.filters import detrended
from swashplate.flights.flight import Flight
from swashplate.flights.maneuvers.sweep_tracking import Ridge
from swashplate.flights.provenance import Event
from swashplate.flights.schema import is_known

_CYCLES = 6.0  # of a wavelet: resolves a third of an octave
_PER_OCTAVE = 8
_FRAMES = 8.0  # Hz: how often the ridge is looked at
_FASTEST = 60.0  # Hz: sampled faster, nothing is gained; helicopters are swept to 20 Hz
_HIGHEST = 0.45  # of the sample rate
_SHARE = 0.35  # of the local power that a ridge must hold on average
_CONTRAST = 0.8  # octaves: a sweep of two octaves reaches 1.3, the largest of 125 paths in 250 h of noise 0.61
_UNUSUAL = 0.1  # of that share: a ridge that ends in a tone which lasts is cut off before it
_LEAST_RATIO = 2.5  # highest over lowest frequency
_LEAST_PERIODS = 8.0
_LEAST_SECONDS = 4.0
_WINDOW = 1800.0  # s that are searched at a time
_SHARED = 300.0  # s: of a sweep at a quarter of an octave a minute this is enough to be seen
_AT_THE_END = 10.0  # s: a sweep that stops so near to a window's end may go on behind it
_SEEN_WITHIN = 0.2  # of the median amplitude: the sweep's ends
_COMMANDS = ("mixer_", "servo_", "motor_", "stick_", "sid_target", "rcin_")
_SETPOINT = "_demand"
_AXES = {"p": "roll", "q": "pitch", "r": "yaw", "phi": "roll", "theta": "pitch", "psi": "yaw"}
_AXES |= {name: name for name in ("roll", "pitch", "yaw", "collective")}


@dataclass(frozen=True)
class Sweep:
    """A sweep that was flown.

    Attributes:
        start, stop: [s], on the flight's clock.
        axis: what it moves ("roll mixer", "roll"; a channel's name where that is all that is known).
        low, high: the band [Hz].
        channel: the signal it was seen in, or the one that carries it.
        source: "log" (the autopilot says so) or "signal" (seen as a rising frequency; its ends are about right).
        complete: False where the log says that it was not flown to its end.
    """

    start: float
    stop: float
    axis: str
    low: float
    high: float
    channel: str
    source: str
    complete: bool = True

    def __str__(self) -> str:
        by = "as the log says" if self.source == "log" else f"seen in {self.channel}"
        cut = "" if self.complete else ", not flown to its end"
        return f"{self.axis}: {self.start:.2f} to {self.stop:.2f} s, {self.low:.3g} to {self.high:.3g} Hz ({by}{cut})"


def sweeps(flight: Flight) -> tuple[Sweep, ...]:
    """The sweeps in a flight, in order of time; those that the log tells of need not be seen in a signal."""
    logged = tuple(_logged_sweeps(flight))
    shown = _visible_sweeps(flight, [(sweep.start, sweep.stop) for sweep in logged])
    return tuple(sorted((*logged, *shown), key=lambda sweep: sweep.start))


def _logged_sweeps(flight: Flight) -> list[Sweep]:
    swept = []
    for event in flight.provenance.events:
        if event.kind != "sweep":
            continue
        d = {key: _number(flight, event, key) for key in ("seen", "start", "stop", "start_hz", "stop_hz")}
        stop, added = min(d["seen"], flight.stop), ("sid_target", event.details.get("channel"))
        channel = next((str(name) for name in added if name in flight), "")
        if stop > flight.start and d["start"] < flight.stop:
            axis = event.text.partition(",")[0]
            complete = stop > d["stop"] - 0.1
            swept.append(Sweep(d["start"], stop, axis, d["start_hz"], d["stop_hz"], channel, "log", complete))
    return swept


def _number(flight: Flight, event: Event, key: str) -> float:
    value = event.details.get(key)
    if isinstance(value, bool) or not isinstance(value, int | float) or not np.isfinite(value):
        raise FlightError(
            f"the sweep at {event.time:g} s has {value!r} for '{key}', expected a number.",
            where=flight.provenance.source or None,
            channel="events",
            hint="The file is damaged: read the log itself again.",
        )
    return float(value)


def _candidates(flight: Flight) -> list[str]:
    """Commands and set-points; where no channel is known as one, every channel that the schema does not know."""
    commands = [name for name in flight.channels if name.startswith(_COMMANDS) or name.endswith(_SETPOINT)]
    return commands or [name for name in flight.channels if not is_known(name)]


def _axis(name: str) -> str:
    """What a channel moves, as far as its name says; else the name."""
    first, _, last = name.removesuffix(_SETPOINT).rpartition("_")
    return _AXES.get(last, _AXES.get(first, name))


def _visible_sweeps(flight: Flight, logged: Sequence[tuple[float, float]]) -> list[Sweep]:
    """Sweeps in the signals beside the `logged` ones; of several channels that show one, the command that moves most.

    A set-point speaks where no command shows the sweep: a loop may hide it there.
    """
    candidates: list[tuple[bool, float, Sweep]] = []
    for name in _candidates(flight):
        time, values = flight.time(name), flight.values(name)
        for start, stop in unbroken_in_mode(flight, time):
            inside = slice(*np.searchsorted(time, (start, np.nextafter(stop, np.inf))).tolist())
            for ridge in all_rising(time[inside], values[inside]):
                low, high = float(ridge.frequency[0]), float(ridge.frequency[-1])
                amplitude = float(np.median(ridge.amplitude))
                amplitude /= 1e-3 if name.startswith("rcin_") else 1.0  # pulses move by 0.5 ms
                sweep = Sweep(ridge.start, ridge.stop, _axis(name), low, high, name, "signal")
                candidates.append((name.endswith(_SETPOINT), -amplitude, sweep))
    kept: list[Sweep] = []
    for *_, sweep in sorted(candidates, key=lambda item: item[:2]):
        others = (*logged, *((other.start, other.stop) for other in kept))
        if not any(sweep.start < stop and start < sweep.stop for start, stop in others):
            kept.append(sweep)
    return kept


def unbroken_in_mode(flight: Flight, time: Array) -> list[tuple[float, float]]:
    """From and to [s]: stretches of stamps without a gap in which the autopilot keeps its mode. No sweep crosses one.

    Args:
        flight: whose events tell of modes.
        time: stamps [s], shape (n,).
    """
    if time.size < 2:
        return []
    step = np.diff(time)
    breaks = np.flatnonzero(step > max(10.0 * float(np.median(step)), 0.5)) + 1
    switched = np.searchsorted(time, [event.time for event in flight.provenance.events if event.kind == "mode"])
    inner = {*breaks.tolist(), *switched.tolist()} - {0, time.size}
    edges = [0, *sorted(inner), time.size]
    return [(float(time[a]), float(time[b - 1])) for a, b in pairwise(edges) if b - a > 1]


def all_rising(time: Array, values: Array) -> list[Ridge]:
    """The sweeps in a signal, in order of time; arguments as of `rising`.

    A long signal is searched in windows which share what a sweep needs to be seen: a log of hours has no room for one
    scalogram. A window in which a sweep goes on to the end is made longer.
    """
    ridges: list[Ridge] = []
    begin, length = 0, _WINDOW
    while begin < time.size:
        end = int(np.searchsorted(time, time[begin] + length, side="right"))
        here = _rising_in(time[begin:end], values[begin:end])
        if end < time.size and here and here[-1].stop > time[end - 1] - _AT_THE_END:
            length += _WINDOW
            continue
        ridges += here
        if end == time.size:
            break
        last_stop = here[-1].stop if here else -np.inf
        begin, length = int(np.searchsorted(time, max(time[end - 1] - _SHARED, last_stop), side="right")), _WINDOW
    return ridges


def _rising_in(time: Array, values: Array) -> list[Ridge]:
    """The strongest sweep in a window, and those before and after it."""
    ridge = rising(time, values)
    if ridge is None:
        return []
    before = slice(None, int(np.searchsorted(time, ridge.start, side="left")))
    after = slice(int(np.searchsorted(time, ridge.stop, side="right")), None)
    return [*_rising_in(time[before], values[before]), ridge, *_rising_in(time[after], values[after])]


def rising(time: Array, values: Array) -> Ridge | None:
    """The strongest ridge of steadily rising frequency in a signal.

    Args:
        time: strictly increasing stamps [s], shape (n,); values: shape (n,).

    Returns:
        Its course; None where there is no sweep.
    """
    length = float(time[-1] - time[0]) if time.size > 1 else 0.0
    if length < _LEAST_SECONDS or not np.ptp(values) > 0.0:
        return None
    rate = min((time.size - 1) / length, _FASTEST)
    grid = np.arange(int(length * rate) + 1) / rate
    signal = detrended(np.interp(grid + time[0], time, _thinned(time, values, rate)))
    low, high = max(2.0 / length, 0.05), _HIGHEST * rate
    if high < _LEAST_RATIO * low:
        return None
    frequency = low * 2.0 ** (np.arange(int(_PER_OCTAVE * np.log2(high / low)) + 1) / _PER_OCTAVE)
    hop = max(1, round(rate / _FRAMES))
    amplitude, power = _scalogram(signal, frequency, rate=rate, hop=hop)
    floor = 1e-6 * float(np.max(power))
    if not floor > np.finfo(np.float64).tiny:  # its squares are no numbers any more
        return None
    held = np.minimum(0.5 * amplitude**2 / np.maximum(power, floor), 1.0)
    share = np.where(0.5 * amplitude**2 < 1e-3 * float(np.max(0.5 * amplitude**2)), 0.0, held)
    stamps = time[0] + grid[::hop]
    # A resonance outlasts a sweep beside it: the second search leaves out what every frequency always has.
    for usual in (0.0, np.median(held, axis=1, keepdims=True)):
        path = _best_path(share - usual - _SHARE)
        ridge = None if path is None else _as_sweep(stamps, frequency, amplitude, held, path)
        if ridge is not None:
            return ridge
    return None


def _as_sweep(
    stamps: Array, frequency: Array, amplitude: Array, share: Array, path: tuple[int, NDArray[np.int64]]
) -> Ridge | None:
    """The ridge along a path where it is a sweep: long, wide and steady enough, and no chance of noise.

    Args:
        stamps: of the frames [s], shape (frames,). frequency: of the rows [Hz], shape (rows,).
        amplitude, share: shape (rows, frames).
        path: its first frame, and its rows.
    """
    first, rows = path
    frames = first + np.arange(rows.size)
    beyond, place = _beyond(share[rows, frames], rows, share)
    strong = np.flatnonzero(beyond[place] > _UNUSUAL)
    if not strong.size:
        return None
    rows, frames = rows[strong[0] : strong[-1] + 1], frames[strong[0] : strong[-1] + 1]
    strength = amplitude[rows, frames]
    loud = np.flatnonzero(strength > _SEEN_WITHIN * np.median(strength))
    heard = slice(int(loud[0]), int(loud[-1]) + 1)
    frames, rows, strength = frames[heard], rows[heard], strength[heard]
    band = frequency[rows]
    step = float(stamps[1] - stamps[0])
    seconds, periods = frames.size * step, float(np.sum(band)) * step
    if band[-1] < _LEAST_RATIO * band[0] or seconds < _LEAST_SECONDS or periods < _LEAST_PERIODS:
        return None
    # A sudden jump between two tones is no sweep: it must spend time on the way.
    if np.unique(rows).size < 0.6 * (rows[-1] - rows[0]):
        return None
    held = share[rows, frames]
    beyond, _ = _beyond(held, rows, share[:, frames[0] : frames[-1] + 1])
    if np.sum(beyond) < _CONTRAST * _PER_OCTAVE:
        return None
    return Ridge(stamps[frames], band, strength, float(np.mean(held)))


def _beyond(held: Array, rows: NDArray[np.int64], meanwhile: Array) -> tuple[Array, NDArray[np.intp]]:
    """By how much more of the power a ridge holds at each of its frequencies than the frequency usually does.

    Args:
        held: shares along the ridge, shape (n,). rows: there, shape (n,).
        meanwhile: shares of every row at all times, shape (rows, frames).

    Returns:
        For every row that it visits, rising; and which of them each place on the ridge is in, shape (n,).
    """
    visited, place, times = np.unique(rows, return_inverse=True, return_counts=True)
    return np.bincount(place, held) / times - np.median(meanwhile[visited], axis=1), place


def _thinned(time: Array, values: Array, rate: float) -> Array:
    """The signal averaged over the steps of a slower rate, so that nothing folds back into the band."""
    width = round((time.size - 1) / float(time[-1] - time[0]) / rate)
    return np.convolve(values, np.full(width, 1.0 / width), mode="same") if width > 1 else values


def _scalogram(signal: Array, frequency: Array, *, rate: float, hop: int) -> tuple[Array, Array]:
    """Amplitude at each frequency and power around it in time, both of shape (frequencies, frames).

    The power is that of the whole signal within the wavelet's own window, slow drift (below half the lowest frequency)
    apart: a pure tone holds all of it.
    """
    n = signal.size
    frames = -(-n // hop)
    # Behind the signal there is room for its own length, or for what the longest wavelet reaches.
    reach = int(_NOTHING * _CYCLES / (2.0 * np.pi * frequency[0]) * rate / hop) + 1
    short = int(2 ** np.ceil(np.log2(frames + min(frames, reach))))
    size = short * hop  # the inverse transform's every hop-th sample is that of its folded spectrum
    spectrum = np.fft.fft(signal, size)
    bins = np.fft.fftfreq(size, 1.0 / rate)
    spectrum[np.abs(bins) < 0.5 * frequency[0]] = 0.0
    squared = np.fft.rfft(np.real(np.fft.ifft(spectrum))[:n] ** 2, size)
    amplitude = np.empty((frequency.size, frames))
    power = np.empty_like(amplitude)
    bins = bins[: size // 2]  # of a real signal's one side
    step = rate / size
    for i, f in enumerate(frequency):
        spread = _CYCLES / (2.0 * np.pi * f)  # standard deviation of the Gaussian window [s]
        wide = _NOTHING / (2.0 * np.pi * spread)
        here = slice(max(0, int((f - wide) / step)), min(bins.size, int((f + wide) / step) + 2))
        window = 2.0 * np.exp(-0.5 * (2.0 * np.pi * (bins[here] - f) * spread) ** 2)
        amplitude[i] = np.abs(_sampled(spectrum[here] * window, here.start, short, hop))[:frames]
        here = slice(0, min(bins.size, int(np.sqrt(2.0) * wide / step) + 2))
        smooth = squared[here] * np.exp(-0.5 * (2.0 * np.pi * bins[here] * spread / np.sqrt(2.0)) ** 2)
        if smooth.size <= short // 2:
            power[i] = np.fft.irfft(smooth, short)[:frames] / hop
        else:
            smooth[1:] *= 2.0  # its real part has both sides
            power[i] = np.real(_sampled(smooth, 0, short, hop))[:frames]
    return amplitude, np.maximum(power, 0.0)


_NOTHING = 8.5
"""Standard deviations at which a Gaussian is 2e-16."""


def _sampled(part: Complex, first: int, short: int, hop: int) -> Complex:
    """Every hop-th sample of an inverse transform of `short * hop` bins, zero but for a part from `first` on."""
    folded = np.zeros(-(-(first + part.size) // short) * short, dtype=np.complex128)
    folded[first : first + part.size] = part
    return np.asarray(np.fft.ifft(folded.reshape(-1, short).sum(axis=0)) / hop)


_REACH = 3
"""Rows that a path rises in a frame at most: 3 octaves a second."""


def _best_path(gain: Array) -> tuple[int, NDArray[np.int64]] | None:
    """First frame and rows of the path with the largest sum of gains that never falls in frequency (Viterbi)."""
    rows, frames = gain.shape
    # Sums of the paths that end at a row, behind a margin from which none comes.
    sums = np.full((frames + 1, _REACH + rows), -np.inf)
    sums[0, _REACH:] = 0.0
    two = np.empty(_REACH + rows - 1)
    for before, after, gained in zip(sums, sums[1:, _REACH:], np.ascontiguousarray(gain.T), strict=False):
        np.maximum(before[1:], before[:-1], out=two)  # the better of a row and the one below
        np.maximum(two[_REACH - 1 :], two[: 1 - _REACH], out=after)
        np.maximum(after, 0.0, out=after)  # or one begins here
        after += gained
    best = sums[1:, _REACH:]
    k, row = divmod(int(best.argmax()), rows)
    if best[k, row] <= 0.0:
        return None
    path = [row]
    while True:
        from_below = sums[k, row : row + _REACH + 1][::-1]
        step = int(from_below.argmax())
        if not from_below[step] > 0.0:
            return k, np.asarray(path[::-1], dtype=np.int64)
        row, k = row - step, k - 1
        path.append(row)
