"""Noise and vibration in a gyro before and behind the filters that the log's parameters configure."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from swashplate.arrays import Array
from swashplate.flights.averaged_spectra import power_density
from swashplate.flights.flight import Flight
from swashplate.flights.review.filters import Filter, gyro_response
from swashplate.flights.review.stretches import armed, common
from swashplate.flights.schema import RATES
from swashplate.flights.spectrum import ROTORS

NOISE = 20.0
"""Hz: what shakes faster is no motion of the aircraft that a loop should answer."""
_WINDOW = 1.0  # s
_LEAST_RATE = 60.0  # Hz
_LEAST = 8  # windows
_STANDS_OUT = 10.0  # dB above its surroundings
_BESIDE = 21  # lines whose median is a line's surroundings
_FAINT = 0.1  # gain of the filters below which what was before them cannot be told
_SAME = 0.04  # of a rotor's multiple
_MOST = 4  # peaks that are told
_WIDTH = 0.5  # of its frequency: a notch's usual width
_WORTH, _MATTERS = 0.1, 0.5  # of the noise's power, and deg/s, that a notch must take out
_HEARD = 0.1  # deg/s: a peak below is told of no gyro
_UNFILTERED = {"blackbox": "_imu", "blackbox csv": "_imu", "ardupilot": "_raw"}
"""End of the channels of a gyro before its filters, by reader."""


@dataclass(frozen=True)
class Peak:
    """What stands out: its frequency [Hz], rms [deg/s], power above its surroundings [dB], and what turns like that."""

    frequency: float
    rms: float
    above: float
    source: str = ""


@dataclass(frozen=True)
class AnotherNotch:
    """What one more notch would do.

    Attributes:
        frequency, width: [Hz]; delay: what it costs [s].
        before, after: rms above 20 Hz behind all filters, without it and with it [deg/s].
        parameters: the autopilot's, () where it has no place for one more.
    """

    frequency: float
    width: float
    delay: float
    before: float
    after: float
    parameters: tuple[tuple[str, float], ...] = ()

    def __str__(self) -> str:
        settings = ", ".join(f"{name} {value:g}" for name, value in self.parameters)
        return (
            f"one more notch at {self.frequency:.3g} Hz would take the noise from {self.before:.3g} to {self.after:.3g}"
            f" deg/s and cost {1e3 * self.delay:.2f} ms{f': {settings}' if settings else ''}"
        )


@dataclass(frozen=True)
class GyroNoise:
    """Spectra of one gyro axis.

    Attributes:
        channel: behind the filters.
        frequency: [Hz], shape (n,); after, before: one-sided densities [(deg/s)^2/Hz], shape (n,), NaN where what was
            before the filters cannot be told.
        source: of `before`: the channel that was measured, or "" where `after` is divided by the filters' response.
        rms_after, rms_before: above 20 Hz [deg/s].
        peaks: behind the filters, the strongest first. notch: what one more would do; None where none would help.
    """

    channel: str
    frequency: Array
    after: Array
    before: Array
    source: str
    rms_after: float
    rms_before: float
    peaks: tuple[Peak, ...]
    notch: AnotherNotch | None

    def __str__(self) -> str:
        how = f"measured in {self.source}" if self.source else "by the filters' own response"
        peaks = "; ".join(
            f"{p.frequency:.3g} Hz {p.rms:.2g} deg/s{f' ({p.source})' if p.source else ''}" for p in self.peaks
        )
        text = f"{self.channel}: {self.rms_after:.3g} deg/s rms above {NOISE:g} Hz"
        if np.isfinite(self.rms_before):
            text += f", {self.rms_before:.3g} before the filters ({how})"
        return text + (f"; stands out: {peaks}" if peaks else "; nothing stands out")


def gyro_noise(flight: Flight, chosen: tuple[Filter, ...]) -> tuple[tuple[GyroNoise, ...], str]:
    """Spectra of the gyro's axes, and why there are none ("" where there are)."""
    there = [name for name in RATES if name in flight and flight.time(name).size > 2]
    fast = [name for name in there if flight.rate(name) >= _LEAST_RATE]
    if not fast:
        rates = f" ({flight.rate(there[0]):.3g} Hz)" if there else ""
        return (), f"rates are logged too slowly for a spectrum of noise{rates}: {_LEAST_RATE:g} Hz are needed"
    spectra = [each for name in fast if (each := _of(flight, name, chosen)) is not None]
    return tuple(spectra), "" if spectra else "no stretch of flight is long enough for a spectrum of noise"


def _density(flight: Flight, name: str) -> tuple[Array, Array] | None:
    """Lines [Hz] and densities [(deg/s)^2/Hz] of a channel while the motors are armed."""
    time, values = flight.time(name), np.degrees(flight.values(name))
    steps = np.diff(time)
    rate = 1.0 / float(np.median(steps))
    edges = [0, *(np.flatnonzero(steps > max(10.0 / rate, 0.2)) + 1).tolist(), time.size]
    runs = [(time[a], time[b - 1]) for a, b in pairwise(edges) if b - a > 1]
    size, total, count = round(_WINDOW * rate), None, 0
    lines = np.zeros(0)
    for start, stop in common(runs, armed(flight)):
        grid = start + np.arange(int((stop - start) * rate)) / rate
        if grid.size < size:
            continue
        lines, power = power_density(np.interp(grid, time, values), rate=rate, window=size, line=True)
        windows = 1 + (grid.size - size) // (size - size // 2)
        total = windows * power + (0.0 if total is None else total)
        count += windows
    return None if total is None or count < _LEAST else (lines, total / count)


def _of(flight: Flight, name: str, chosen: tuple[Filter, ...]) -> GyroNoise | None:
    density = _density(flight, name)
    if density is None or density[0][-1] <= NOISE:
        return None
    frequency, after = density
    gain = gyro_response(chosen, frequency)
    raw = f"{name}{_UNFILTERED.get(flight.provenance.reader, '?')}"
    measured = _density(flight, raw) if raw in flight else None
    if measured is not None:
        before = np.interp(frequency, *measured, right=np.nan)
    else:
        raw = ""
        before = np.where(gain >= _FAINT, after / np.maximum(gain, _FAINT) ** 2, np.nan)
    loud = frequency > NOISE
    step = float(frequency[1])
    rms = [float(np.sqrt(step * np.nansum(each[loud]))) for each in (after, before)]
    known = bool(np.all(np.isfinite(before[loud]))) and (bool(raw) or any(f.place == "gyro" for f in chosen))
    peaks = _peaks(flight, frequency, after)
    notch = _another(flight, frequency, after, peaks)
    return GyroNoise(name, frequency, after, before, raw, rms[0], rms[1] if known else float("nan"), peaks, notch)


def _peaks(flight: Flight, frequency: Array, density: Array) -> tuple[Peak, ...]:
    from scipy.ndimage import median_filter  # a quarter of a second to import

    around = np.maximum(median_filter(density, size=_BESIDE, mode="nearest"), np.finfo(np.float64).tiny)
    above = 10.0 * np.log10(np.maximum(density, np.finfo(np.float64).tiny) / around)
    step = float(frequency[1])
    peaks = []
    for k in range(2, frequency.size - 2):
        if frequency[k] > NOISE and above[k] >= _STANDS_OUT and density[k] == density[k - 2 : k + 3].max():
            rms = float(np.sqrt(step * np.sum(density[k - 2 : k + 3])))
            if rms >= _HEARD:
                peaks.append(Peak(float(frequency[k]), rms, float(above[k]), _turns(flight, float(frequency[k]))))
    return tuple(sorted(peaks, key=lambda peak: -peak.rms)[:_MOST])


def _turns(flight: Flight, frequency: float) -> str:
    """The rotor or motor whose speed, or a multiple of it, a frequency is."""
    names = [*ROTORS, *(name for name in flight.channels if name.startswith("omega_motor_"))]
    for name in (each for each in names if each in flight):
        values = np.abs(flight.values(name))
        values = values[np.isfinite(values) & (values > 0.2 * np.nanmax(values, initial=1.0))]
        speed = float(np.median(values)) / (2.0 * np.pi) if values.size else 0.0
        number = round(frequency / speed) if speed > 1.0 else 0
        if 1 <= number <= 8 and abs(frequency - number * speed) < _SAME * frequency:
            return f"{number} x {name}"
    return ""


def _another(flight: Flight, frequency: Array, density: Array, peaks: tuple[Peak, ...]) -> AnotherNotch | None:
    """A notch at the strongest peak, where it takes out enough."""
    if not peaks:
        return None
    centre = round(peaks[0].frequency)
    notch = Filter("", "gyro", "notch", centre, width=_WIDTH * centre, left=0.01)
    loud = frequency > NOISE
    gain = np.abs(notch.response(frequency)) ** 2
    before, after = (float(np.sqrt(frequency[1] * np.sum((density * g)[loud]))) for g in (np.ones(gain.shape), gain))
    if before**2 - after**2 < max(_WORTH * before**2, _MATTERS**2):
        return None
    return AnotherNotch(float(centre), notch.width, notch.delay, before, after, _named(flight, notch))


def _named(flight: Flight, notch: Filter) -> tuple[tuple[str, float], ...]:
    """The parameters that set a fixed notch; none where the autopilot has no free one."""
    k, reader = flight.provenance.parameters, flight.provenance.reader
    if reader == "ardupilot":
        free = [name for name in ("INS_HNTCH", "INS_HNTC2") if not k.get(f"{name}_ENABLE", 0.0) > 0.0]
        values = {"ENABLE": 1, "MODE": 0, "FREQ": notch.frequency, "BW": round(notch.width, 1), "ATT": 40, "HMNCS": 1}
        return tuple((f"{free[0]}_{end}", float(value)) for end, value in values.items()) if free else ()
    if reader == "ulog":
        free = [n for n in (0, 1) if not k.get(f"IMU_GYRO_NF{n}_FRQ", 0.0) > 0.0]
        settings = (("FRQ", notch.frequency), ("BW", round(notch.width, 1)))
        return tuple((f"IMU_GYRO_NF{free[0]}_{end}", float(value)) for end, value in settings) if free else ()
    if reader == "blackbox":
        names = ("gyro_notch_hz_0", "gyro_notch_hz_1")
        free = [n for n, name in enumerate(names, 1) if not k.get(name, 0.0) > 0.0]
        corner = notch.frequency * (np.sqrt(1.0 + 0.25 * _WIDTH**2) - 0.5 * _WIDTH)
        settings = (("hz", notch.frequency), ("cutoff", float(round(corner))))
        return tuple((f"gyro_notch{free[0]}_{end}", value) for end, value in settings) if free else ()
    return ()
