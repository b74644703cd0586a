"""What frequencies a channel holds: power spectral density, spectrogram, and the harmonics of a rotor in it.

Densities are one-sided averages over Hann windows that overlap by half (Welch 1967); their integral over frequency is
the variance. The unit is that of the screen: deg/s where the channel is shown so.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from swashplate.arrays import Array
from swashplate.errors import FlightError
from swashplate.flights.averaged_spectra import power_density
from swashplate.flights.flight import Flight
from swashplate.flights.schema import channel as schema_of
from swashplate.shown import Shown

WINDOWS = 16
"""Windows that an average has at least, where the record is long enough for any."""
ROTORS = ("omega_rotor", "omega_lower", "omega_upper")
HARMONICS = 8
_SHORTEST = 32  # samples
_GAP = (10.0, 0.5)  # usual steps, and seconds: longer than both is a gap
_STANDS_OUT = 10.0  # dB; averages of 16 windows scatter by a decibel
_BESIDE, _AVERAGED = 8, 8  # densities between multiples, and windows, from which one may be told to stand out
_MARGIN = 0.9  # of the lowest speed that was flown: notches follow down to there
_WIDTH = 0.04  # of a harmonic's frequency, to each side: the rotor's speed is never quite still


@dataclass(frozen=True)
class Spectrum(Shown):
    """A channel's power spectral density.

    Attributes:
        channel, unit: what it is of; the density is in unit^2/Hz.
        frequency: [Hz], shape (n,); density: shape (n,).
        windows, seconds: how many were averaged, and how long each is [s].
        start, stop: the stretch that was used [s], the longest without a gap.
        rate: of its samples [Hz].
    """

    channel: str
    unit: str
    frequency: Array
    density: Array
    windows: int
    seconds: float
    start: float
    stop: float
    rate: float

    def rms(self, low: float, high: float) -> float:
        """Root mean square of what lies in a band [Hz], in the channel's unit."""
        step = float(self.frequency[1] - self.frequency[0])
        inside = (self.frequency >= low) & (self.frequency <= high)
        return float(np.sqrt(np.sum(self.density[inside]) * step))

    @property
    def cutoff(self) -> float:
        """Frequency [Hz] below which half of the mean square lies (Tischler and Remple 2012, ch. 5); NaN at rest."""
        power = np.cumsum(self.density[1:])
        if not power[-1] > 0.0:
            return float("nan")
        return float(np.interp(0.5 * power[-1], power, self.frequency[1:]))

    def __str__(self) -> str:
        return (
            f"{self.channel}: {self.windows} windows of {self.seconds:.3g} s from {self.start:.2f} to {self.stop:.2f} s"
            f", up to {0.5 * self.rate:.4g} Hz; rms {self.rms(self.frequency[1], self.frequency[-1]):.4g} {self.unit}"
            f", cut-off {self.cutoff:.3g} Hz"
        )


@dataclass(frozen=True)
class Spectrogram(Shown):
    """Densities over time: `density` has shape (len(frequency), len(time)), in unit^2/Hz."""

    channel: str
    unit: str
    time: Array
    frequency: Array
    density: Array


@dataclass(frozen=True)
class Harmonic:
    """A multiple of a rotor's speed: its number, frequency [Hz], and the rms around it in the channel's unit.

    `above` [dB] is how far its power stands above that of the densities between the multiples, None where the stretch
    is too short to tell the multiples apart.
    """

    number: int
    frequency: float
    rms: float
    above: float | None


@dataclass(frozen=True)
class Notches:
    """Notch filters that follow a rotor's speed and take its harmonics out of a gyro.

    Attributes:
        numbers: the multiples of the speed, each with a notch.
        lowest: speed below which they no longer follow [Hz]; width: of the first between its -3 dB points there [Hz],
            of the others as many times that as their number.
        delay: what all of them cost together at frequencies far below the first, at `speed` [s].
        parameters: ArduPilot's, for a sensor of the rotor's speed (its page "RPM Sensor Based Dynamic Notch Setup").
    """

    numbers: tuple[int, ...]
    lowest: float
    width: float
    delay: float
    parameters: dict[str, float]

    def __str__(self) -> str:
        every = ", ".join(f"{number} x" for number in self.numbers)
        return (
            f"Notches at {every} of the rotor's speed take out what stands out by {_STANDS_OUT:g} dB and more. They "
            f"delay slow motion by {1e3 * self.delay:.1f} ms: fly with them before you tune gains."
        )


@dataclass(frozen=True)
class Harmonics(Shown):
    """Rotor vibration in a channel.

    Attributes:
        spectrum: of the channel.
        rotor: the channel of the rotor's speed; speed: its mean there [Hz].
        harmonics: those that the sample rate shows; total: rms of all above 2 Hz.
        summary: what is strongest, or why nothing is seen.
        notches: for the harmonics that stand out; None where none does.
    """

    spectrum: Spectrum
    rotor: str
    speed: float
    harmonics: tuple[Harmonic, ...]
    total: float
    summary: str
    notches: Notches | None = None

    @property
    def about_notches(self) -> str:
        """Which notches an autopilot needs by this channel, or why it cannot be said."""
        if self.notches is not None:
            return str(self.notches)
        if self.spectrum.unit != "deg/s":
            return "An autopilot's notches filter its gyros: look at p, q or r."
        if not self.harmonics or any(h.above is None for h in self.harmonics):
            return "Notches cannot be judged: the stretch is too short or the samples too slow."
        return (
            f"Up to {0.5 * self.spectrum.rate:.4g} Hz no harmonic stands out by {_STANDS_OUT:g} dB, so this channel as "
            "it was logged needs no notch. Behind a filter it shows only what the filter leaves."
        )

    def __str__(self) -> str:
        unit = self.spectrum.unit
        lines = [f"  {h.number} x: {h.frequency:.2f} Hz, rms {h.rms:.4g} {unit}" for h in self.harmonics]
        lines.append(f"  {self.about_notches}")
        return "\n".join([f"{self.spectrum.channel} beside {self.rotor} ({self.speed:.2f} Hz): {self.summary}", *lines])


def _piece(flight: Flight, name: str, start: float | None, stop: float | None) -> tuple[Array, Array, float]:
    """Stamps and values of the longest stretch without a gap, at equal steps, and their rate."""
    time, values = flight.time(name), flight.values(name) * schema_of(name).shown_factor
    inside = (time >= (-np.inf if start is None else start)) & (time <= (np.inf if stop is None else stop))
    inside &= np.isfinite(values)
    time, values = time[inside], values[inside]
    if time.size >= 2:
        steps = np.diff(time)
        cuts = np.flatnonzero(steps > max(_GAP[0] * float(np.median(steps)), _GAP[1])) + 1
        edges = np.concatenate([[0], cuts, [time.size]])
        longest = int(np.argmax(np.diff(edges)))
        time, values = time[edges[longest] : edges[longest + 1]], values[edges[longest] : edges[longest + 1]]
    if time.size < _SHORTEST:
        raise FlightError(
            f"has {time.size} samples in a row there, expected at least {_SHORTEST} for a spectrum.",
            where=flight.provenance.source or None,
            channel=name,
            hint="Take a longer stretch.",
        )
    rate = 1.0 / float(np.median(np.diff(time)))
    grid = time[0] + np.arange(int((time[-1] - time[0]) * rate + 1e-6) + 1) / rate
    return grid, np.interp(grid, time, values), rate


def spectrum(flight: Flight, channel: str, *, start: float | None = None, stop: float | None = None) -> Spectrum:
    """Power spectral density of a channel between two times.

    Args:
        channel: its name.
        start, stop: [s]; all of the flight where not given. The longest stretch without a gap is used.

    Raises:
        FlightError: no such channel, or too few samples.
    """
    grid, values, rate = _piece(flight, channel, start, stop)
    size = min(values.size, max(_SHORTEST, 2 * values.size // (WINDOWS + 1))) // 2 * 2
    frequency, power = power_density(values, rate=rate, window=size)
    count = 1 + (values.size - size) // (size - size // 2)
    unit = _unit(flight, channel)
    return Spectrum(
        channel, unit, frequency, power, count, size / rate, float(grid[0]), float(grid[-1]), rate
    )  # fmt: skip


def spectrogram(
    flight: Flight, channel: str, *, start: float | None = None, stop: float | None = None, frames: int = 200
) -> Spectrogram:
    """Densities of a channel over time.

    Args:
        channel, start, stop: as of `spectrum`.
        frames: about how many times it is looked at.

    Raises:
        FlightError: no such channel, or too few samples.
    """
    from scipy import signal  # half a second to import, and reports import this module

    grid, values, rate = _piece(flight, channel, start, stop)
    size = int(np.clip(values.size // 40, _SHORTEST, 1024))
    step = max(1, values.size // frames)
    frequency, time, density = signal.spectrogram(
        values, fs=rate, nperseg=size, noverlap=max(0, size - step), detrend="constant"
    )
    return Spectrogram(channel, _unit(flight, channel), grid[0] + time, frequency, density)


def harmonics(
    flight: Flight,
    channel: str,
    *,
    rotor: str | None = None,
    start: float | None = None,
    stop: float | None = None,
) -> Harmonics:
    """What a rotor shakes into a channel: the rms at multiples of its speed.

    Args:
        channel: for example "az" or "p".
        rotor: the channel of the rotor's speed; the first that the flight has where not given.
        start, stop: as of `spectrum`.

    Raises:
        FlightError: no rotor's speed in the log, a rotor that stands, or too few samples.
    """
    name = rotor or next((each for each in ROTORS if each in flight), None)
    if name is None:
        raise FlightError(
            "has no rotor speed, so nothing can be held against its harmonics.",
            where=flight.provenance.source or None,
            channel=", ".join(ROTORS),
            hint="Log the headspeed (ArduPilot: RPM sensor), or look at the spectrum alone.",
        )
    measured = spectrum(flight, channel, start=start, stop=stop)
    time, speed = flight.time(name), flight.values(name)
    there = speed[(time >= measured.start) & (time <= measured.stop) & np.isfinite(speed)]
    turning = float(np.median(there)) / (2.0 * np.pi) if there.size else 0.0
    if not abs(turning) > 0.5:
        raise FlightError("does not turn there.", where=flight.provenance.source or None, channel=name)
    turning, highest = abs(turning), 0.5 * measured.rate
    step = float(measured.frequency[1] - measured.frequency[0])
    orders = [k for k in range(1, HARMONICS + 1) if k * turning * (1.0 + _WIDTH) < highest]
    lines = []
    for k in orders:
        half = max(_WIDTH * turning, 2.0 * step)
        rms = measured.rms(k * turning - half, k * turning + half)
        lines.append(Harmonic(k, k * turning, rms, _above(measured, k, turning, half, rms)))
    total = measured.rms(2.0, highest)
    if not lines:
        text = (
            f"nothing of the rotor can be seen: it turns at {turning:.2f} Hz, and {measured.rate:.4g} samples a second "
            f"show up to {highest:.4g} Hz. What it shakes folds back to other frequencies: log faster."
        )
    else:
        most = max(lines, key=lambda harmonic: harmonic.rms)
        share = (most.rms / total) ** 2 if total > 0.0 else 0.0
        text = (
            f"the strongest is {most.number} x at {most.frequency:.2f} Hz with {most.rms:.3g} {measured.unit} rms, "
            f"{100.0 * share:.0f} % of the power above 2 Hz."
        )
    turns = np.abs(there) / (2.0 * np.pi)
    return Harmonics(measured, name, turning, tuple(lines), total, text, _notches(measured.unit, turns, lines))


def _above(measured: Spectrum, number: int, turning: float, half: float, rms: float) -> float | None:
    """How far a harmonic's power is above that of the densities half a multiple around it [dB]."""
    apart = np.abs(measured.frequency - number * turning)
    floor = measured.density[(apart > half) & (apart < 0.5 * turning)]
    inside = np.count_nonzero(apart <= half) * float(measured.frequency[1] - measured.frequency[0])
    if floor.size < _BESIDE or measured.windows < _AVERAGED:
        return None
    tiny = np.finfo(np.float64).tiny
    return float(10.0 * np.log10(max(rms**2, tiny) / max(float(np.median(floor)) * inside, tiny)))


def _notches(unit: str, turns: Array, harmonics: Sequence[Harmonic]) -> Notches | None:
    """For what stands out in a gyro; an autopilot's notches filter gyros, and no other channel says what they need."""
    numbers = tuple(h.number for h in harmonics if h.above is not None and h.above >= _STANDS_OUT)
    if not numbers or unit != "deg/s":
        return None
    lowest = round(_MARGIN * float(np.quantile(turns, 0.05)), 1)
    width = round(0.5 * lowest, 1)
    # s^2 + (w/Q) s + w^2 below the line lags by 1/(Q w) at low frequency; width over frequency, 1/Q, is kept.
    delay = sum(width / lowest / (2.0 * np.pi * number * float(np.median(turns))) for number in numbers)
    parameters = {"ENABLE": 1, "MODE": 2, "REF": 1, "FREQ": lowest, "BW": width}
    parameters["HMNCS"] = sum(1 << (number - 1) for number in numbers)
    return Notches(numbers, lowest, width, delay, {f"INS_HNTCH_{name}": value for name, value in parameters.items()})


def _unit(flight: Flight, name: str) -> str:
    return schema_of(name).shown_unit or str(flight[name].attrs.get("units", ""))
