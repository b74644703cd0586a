"""What happened in a flight, with its times: oscillation, saturation, vibration, clipping, lost GPS, power, gaps.

Thresholds of vibration are ArduPilot's ("Measuring vibration": above 30 m/s^2 problems are likely, above 60 nearly
always); of the board's voltage, that of a flight controller fed with 5 V, which resets somewhere below 4.3 V.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from swashplate.arrays import Array
from swashplate.flights.flight import Flight
from swashplate.flights.review.stretches import AXES, Interval, LoopAxis, Stretch, armed, pieces

_FRAME, _HOP = 2.0, 0.25  # s
_SLOWEST, _FASTEST = 0.8, 25.0  # Hz
_PURE = 0.65  # of the power in a frame that lies at one frequency
_LOUD, _SHAKES = 2.5, np.deg2rad(8.0)  # times the usual rms; rad/s
_PERIODS = 5.0
_BY_HAND = 3.0  # Hz: no pilot moves a stick faster
_ASKED = 0.6  # of the motion, that the target or the angle asked for explains
_FULL, _HELD = 0.985, 0.25  # of the range; s
_JOIN = 1.0  # s: incidents that lie closer are one
_VIBRATION, _SEVERE = 30.0, 60.0  # m/s^2
_BOARD = 4.3  # V
_FIX = 3.0  # GPS status of a fix in three dimensions
_GAP = 0.3  # s
_HIGH = 3.0  # m


@dataclass(frozen=True)
class Incident:
    """One thing that happened.

    Attributes:
        kind: "oscillation", "saturation", "vibration", "clipping", "GPS", "power", "gap", "error".
        start, stop: [s]; text: in words, with its numbers.
    """

    kind: str
    start: float
    stop: float
    text: str

    def __str__(self) -> str:
        when = f"{self.start:.1f} s" if self.stop - self.start < 0.05 else f"{self.start:.1f} to {self.stop:.1f} s"
        return f"{when}: {self.text}"


def incidents(flight: Flight, *, swept: Iterable[Interval]) -> tuple[Incident, ...]:
    """What happened while the motors were armed, in order of time.

    Args:
        swept: from and to of sweeps [s]; their motion is no oscillation.
    """
    apart = list(swept)
    happened = [
        *(each for axis in AXES for each in _oscillations(flight, axis, apart)),
        *_saturations(flight, apart),
        *_vibration(flight),
        *_clipping(flight),
        *_gps(flight),
        *_power(flight),
        *_gaps(flight),
        *(Incident("error", e.time, e.time, e.text) for e in flight.provenance.events if e.kind == "error"),
    ]
    return tuple(sorted(happened, key=lambda each: each.start))


def _runs(time: Array, mask: NDArray[np.bool_], *, least: float, step: float) -> list[Interval]:
    """From and to [s] where a mask holds for a time, near ones joined."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], mask.astype(np.int8), [0]])))
    runs = [(float(time[a]), float(time[b - 1]) + step) for a, b in zip(edges[::2], edges[1::2], strict=True)]
    joined: list[Interval] = []
    for start, stop in (run for run in runs if run[1] - run[0] >= least):
        if joined and start - joined[-1][1] < _JOIN:
            joined[-1] = (joined[-1][0], stop)
        else:
            joined.append((start, stop))
    return joined


# ---- oscillation -----------------------------------------------------------------------------------------------------
def _oscillations(flight: Flight, axis: LoopAxis, swept: list[Interval]) -> list[Incident]:
    """Where a rate swings at one frequency, far more than elsewhere, and nobody asked for it."""
    if axis.motion not in flight or not (axis.target in flight or axis.command in flight):
        return []  # no loop is known that could swing
    names = [axis.motion, *(name for name in (axis.target, axis.reference) if name in flight)]
    cut = pieces(flight, names, swept=swept, fastest=100.0, shortest=_FRAME)
    frames = [_frames(piece) for piece in cut]
    if not frames:
        return []
    usual = float(np.median(np.concatenate([rms for _, rms, *_ in frames])))
    happened = []
    for piece, (time, rms, pure, line) in zip(cut, frames, strict=True):
        loud = (pure >= _PURE) & (rms >= max(_LOUD * usual, _SHAKES))
        for start, stop in _runs(time, loud, least=0.0, step=_HOP):
            inside = (time >= start) & (time < stop)
            first, last = start - 0.5 * _FRAME, stop - _HOP + 0.5 * _FRAME
            tone = float(np.median(line[inside]))
            first, last = _narrowed(piece, first, last, 0.5 * float(rms[inside].max()))
            if (last - first) * tone < _PERIODS or _wanted(piece, names, axis, tone, first, last):
                continue
            shown = piece.values[(piece.time >= first) & (piece.time <= last), 0]
            size = np.degrees(float(np.std(shown)))
            text = (
                f"{axis.name} oscillates at {tone:.2g} Hz: {size:.3g} deg/s rms in {axis.motion}, "
                f"{np.degrees(usual):.2g} elsewhere"
            )
            happened.append(Incident("oscillation", first, last, text))
    return happened


def _frames(piece: Stretch) -> tuple[Array, Array, Array, Array]:
    """Middle [s], rms [rad/s], share of the strongest line and its frequency [Hz] of overlapping frames."""
    size, hop = round(_FRAME * piece.rate), max(1, round(_HOP * piece.rate))
    rows = np.lib.stride_tricks.sliding_window_view(piece.values[:, 0], size)[::hop]
    ramp = np.linspace(-1.0, 1.0, size)
    rows = rows - rows.mean(axis=1, keepdims=True) - (rows @ ramp / (ramp @ ramp))[:, None] * ramp
    window = np.hanning(size)
    power = np.abs(np.fft.rfft(rows * window, axis=1)) ** 2
    frequency = np.fft.rfftfreq(size, 1.0 / piece.rate)
    band = np.flatnonzero((frequency >= _SLOWEST) & (frequency <= min(_FASTEST, 0.45 * piece.rate)))
    top = band[np.argmax(power[:, band], axis=1)]
    beside = np.arange(-1, 2) + top[:, None]
    shares = np.take_along_axis(power, np.clip(beside, 0, frequency.size - 1), axis=1).sum(axis=1)
    total = np.maximum(power[:, 1:].sum(axis=1), np.finfo(np.float64).tiny)
    middle = piece.start + (np.arange(len(rows)) * hop + 0.5 * size) / piece.rate
    rms = np.sqrt(np.mean(rows**2, axis=1))
    return np.asarray(middle, dtype=np.float64), np.asarray(rms), np.asarray(shares / total), np.asarray(frequency[top])


def _narrowed(piece: Stretch, start: float, stop: float, half: float) -> Interval:
    """From and to where the motion's rms over half a second is above a level."""
    time, width = piece.time, max(1, round(0.5 * piece.rate))
    level = np.sqrt(np.convolve(piece.values[:, 0] ** 2, np.full(width, 1.0 / width), mode="same"))
    inside = np.flatnonzero((time >= start) & (time <= stop) & (level >= half))
    return (float(time[inside[0]]), float(time[inside[-1]])) if inside.size else (start, stop)


def _wanted(piece: Stretch, names: list[str], axis: LoopAxis, tone: float, start: float, stop: float) -> bool:
    """Whether the angle that is asked for swings like that, or a target that a stick may have moved."""
    inside = (piece.time >= start) & (piece.time <= stop)
    turn = np.exp(-2j * np.pi * tone * piece.time[inside])
    sizes = [abs(np.mean((piece.values[inside, k] - piece.values[inside, k].mean()) * turn)) for k in range(len(names))]
    if axis.reference in names:
        return 2.0 * np.pi * tone * sizes[names.index(axis.reference)] >= _ASKED * sizes[0]
    return axis.target in names and tone < _BY_HAND and sizes[names.index(axis.target)] >= _ASKED * sizes[0]


# ---- outputs ---------------------------------------------------------------------------------------------------------
def _saturations(flight: Flight, swept: list[Interval]) -> list[Incident]:
    """Commands and outputs that stand at the end of their range."""
    happened = []
    for name, low, high in _ranges(flight):
        time, values = flight.time(name), flight.values(name)
        if time.size < 3:
            continue
        part = (values - low) / (high - low)
        ends = (1.0 - _FULL, _FULL)
        full = part >= ends[1]
        if low < 0.0 or (name.startswith("rcout_") and _swashplate(flight)):
            full |= part <= ends[0]
        full &= _during(time, armed(flight)) & ~_during(time, swept)
        step = float(np.median(np.diff(time)))
        for start, stop in _runs(time, full, least=max(_HELD, 2.0 * step), step=step):
            happened.append(Incident("saturation", start, stop, f"{name} stands at the end of its range"))
    return happened


def _ranges(flight: Flight) -> list[tuple[str, float, float]]:
    """Channels of commands and outputs, and the ends of their ranges in the unit inside."""
    happened = [
        (name, -1.0, 1.0)
        for name in ("mixer_roll", "mixer_pitch", "mixer_yaw", "servo_roll", "servo_pitch")
        if name in flight and float(np.nanmax(np.abs(flight.values(name)), initial=0.0)) <= 1.05
    ]
    happened += [
        (name, 0.0, 1.0)
        for name in flight.channels
        if name.startswith("motor_") and float(np.nanmax(flight.values(name), initial=0.0)) <= 1.05
    ]
    k = flight.provenance.parameters
    for name in flight.channels:
        number = name.removeprefix("rcout_")
        function = k.get(f"SERVO{number}_FUNCTION", 0.0)
        if not name.startswith("rcout_") or not (33.0 <= function <= 40.0 or 82.0 <= function <= 85.0):
            continue
        low, high = (k.get(f"SERVO{number}_{end}", usual) for end, usual in (("MIN", 1000.0), ("MAX", 2000.0)))
        if not _swashplate(flight):
            low, high = k.get("MOT_PWM_MIN", 0.0) or low, k.get("MOT_PWM_MAX", 0.0) or high
        if high > low:
            happened.append((name, 1e-6 * low, 1e-6 * high))
    return happened


def _swashplate(flight: Flight) -> bool:
    return "HELI" in flight.provenance.vehicle.upper() or "H_SW_TYPE" in flight.provenance.parameters


def _during(time: Array, intervals: Iterable[Interval]) -> NDArray[np.bool_]:
    inside = np.zeros(time.shape, dtype=np.bool_)
    for start, stop in intervals:
        inside |= (time >= start) & (time <= stop)
    return inside


# ---- sensors, power, the log itself ----------------------------------------------------------------------------------
def _vibration(flight: Flight) -> list[Incident]:
    there = [name for name in ("vibe_x", "vibe_y", "vibe_z") if name in flight]
    if not there:
        return []
    time = flight.time(there[0])
    values = np.stack([flight.values(name) for name in there])
    most = values.max(axis=0)
    step = float(np.median(np.diff(time)))
    happened = []
    for start, stop in _runs(time, (most > _VIBRATION) & _during(time, armed(flight)), least=1.0, step=step):
        inside = (time >= start) & (time <= stop)
        row = int(np.argmax(values[:, inside].max(axis=1)))
        peak = float(values[row, inside].max())
        how = "so much spoils the estimate of place" if peak > _SEVERE else "above 30 problems are likely"
        text = f"vibration of up to {peak:.0f} m/s^2 in {there[row][-1]}: {how}"
        happened.append(Incident("vibration", start, stop, text))
    return happened


def _clipping(flight: Flight) -> list[Incident]:
    happened = []
    for name in (name for name in flight.channels if name.startswith("clips")):
        time, more = flight.time(name), np.diff(flight.values(name), prepend=flight.values(name)[:1])
        step = float(np.median(np.diff(time)))
        for start, stop in _runs(time, (more > 0.0) & _during(time, armed(flight)), least=0.0, step=step):
            count = float(np.sum(more[(time >= start) & (time <= stop) & (more > 0.0)]))
            happened.append(
                Incident("clipping", start, stop, f"an accelerometer was clipped {count:.0f} time{'s' * (count != 1)}")
            )
    return happened


def _gps(flight: Flight) -> list[Incident]:
    if "gps_status" not in flight:
        return []
    time, status = flight.time("gps_status"), flight.values("gps_status")
    had = np.maximum.accumulate(status) >= _FIX
    step = float(np.median(np.diff(time)))
    lost = _runs(time, had & (status < _FIX) & _during(time, armed(flight)), least=0.0, step=step)
    silent = np.flatnonzero(np.diff(time) > max(2.0, 5.0 * step))
    quiet = [(float(time[i]), float(time[i + 1])) for i in silent if _during(time[i : i + 1], armed(flight))[0]]
    return [
        *(Incident("GPS", start, stop, "GPS lost its fix") for start, stop in lost),
        *(Incident("GPS", start, stop, "GPS sent nothing") for start, stop in quiet),
    ]


def _power(flight: Flight) -> list[Incident]:
    happened = []
    if "voltage_board" in flight:
        time, volts = flight.time("voltage_board"), flight.values("voltage_board")
        step = float(np.median(np.diff(time)))
        low = (volts < _BOARD) & (volts > 0.5) & _during(time, armed(flight))
        for start, stop in _runs(time, low, least=0.0, step=step):
            least = float(volts[(time >= start) & (time <= stop)].min())
            happened.append(
                Incident("power", start, stop, f"the board's supply fell to {least:.2f} V: a brown-out is near")
            )
    changes = [event.kind for event in flight.provenance.events if event.kind in ("armed", "disarmed")]
    height = next((name for name in ("altitude_baro", "z") if name in flight), None)
    if changes and changes[-1] == "armed" and height is not None:
        sign = -1.0 if height == "z" else 1.0
        up = sign * flight.values(height)
        above = float(up[-1] - np.min(up))
        if above > _HIGH:
            text = f"the log ends armed and {above:.0f} m up: power was lost (brown-out), or the card was"
            happened.append(Incident("power", flight.stop, flight.stop, text))
    return happened


def _gaps(flight: Flight) -> list[Incident]:
    """Stretches in which nothing at all was logged."""
    every = np.unique(np.concatenate([np.asarray(data["time"].values) for data in flight.streams.values()]))
    if every.size < 3:
        return []
    steps = np.diff(every)
    usual = max(_GAP, 10.0 * min(float(np.median(np.diff(data["time"].values))) for data in flight.streams.values()
                                 if data.sizes["time"] > 1))  # fmt: skip
    inside = _during(every[:-1], armed(flight))
    return [
        Incident("gap", float(every[i]), float(every[i + 1]), f"nothing was logged for {steps[i]:.2g} s")
        for i in np.flatnonzero((steps > usual) & inside)
    ]
