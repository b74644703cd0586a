"""The filters that an autopilot's parameters put between gyro and command, what each costs, and what one more would.

Sources: ArduPilot's pages "Measuring vibration", "Managing gyro noise with the dynamic harmonic notch filters" and its
parameters INS_GYRO_FILTER, INS_HNTCH_*, ATC_RAT_*_FLT*; Betaflight's names in the header of its log; PX4's IMU_GYRO_*.
A low-pass of second order is Butterworth's; a notch is (s^2 + a w/Q s + w^2) / (s^2 + w/Q s + w^2) with a what is left
at its centre.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from swashplate.arrays import Array, Complex
from swashplate.flights.flight import Flight

_AXES = {"RLL": "roll", "PIT": "pitch", "YAW": "yaw"}
_PT = {1: 1.0, 2: 1.553774, 3: 1.961459}
"""Corner of each of n equal first-order stages, over that of them all: 1 / sqrt(2^(1/n) - 1)."""
_GYRO, _TARGET, _ERROR, _SLOPE = "gyro", "target", "error", "derivative"
_NOTCH_MODES = {0: "fixed", 1: "throttle", 2: "rotor speed", 3: "ESC", 4: "FFT", 5: "second rotor speed"}


@dataclass(frozen=True)
class Filter:
    """One filter.

    Attributes:
        name: the parameter that sets it; place: "gyro", "target", "error" or "derivative"; axis: "" for all.
        kind: "low-pass" or "notch"; order: of a low-pass; butterworth: whether its stages are Butterworth's.
        frequency: corner or centre [Hz]; width: of a notch at -3 dB [Hz]; left: gain at its centre.
    """

    name: str
    place: str
    kind: str
    frequency: float
    axis: str = ""
    order: int = 2
    butterworth: bool = True
    width: float = 0.0
    left: float = 0.0

    def response(self, frequency: Array) -> Complex:
        """Its response at frequencies [Hz]."""
        s = 1j * np.asarray(frequency, dtype=np.float64) / self.frequency
        if self.kind == "notch":
            wide = self.width / self.frequency
            return np.asarray((s**2 + self.left * wide * s + 1.0) / (s**2 + wide * s + 1.0), dtype=np.complex128)
        if self.butterworth and self.order == 2:
            return np.asarray(1.0 / (s**2 + np.sqrt(2.0) * s + 1.0), dtype=np.complex128)
        return np.asarray(1.0 / (1.0 + s / _PT[self.order]) ** self.order, dtype=np.complex128)

    @property
    def delay(self) -> float:
        """What it delays slow motion by [s]: the slope of its phase at zero."""
        turn = 2.0 * np.pi * self.frequency
        if self.kind == "notch":
            return (1.0 - self.left) * self.width / self.frequency / turn
        return (np.sqrt(2.0) if self.butterworth and self.order == 2 else self.order / _PT[self.order]) / turn

    def __str__(self) -> str:
        what = f"notch at {self.frequency:.4g} Hz, {self.width:.3g} Hz wide" if self.kind == "notch" else (
            f"low-pass at {self.frequency:.4g} Hz"
        )  # fmt: skip
        where = "" if self.place == _GYRO else f", on the {self.place}"
        return f"{self.name}: {what}{where}: {1e3 * self.delay:.2f} ms"


def filters(flight: Flight) -> tuple[tuple[Filter, ...], tuple[str, ...]]:
    """The filters that a log's parameters configure, and in words those whose frequency the log does not tell."""
    k = flight.provenance.parameters
    if flight.provenance.reader in ("blackbox", "blackbox csv"):
        return _betaflight(k, flight)
    if flight.provenance.reader in ("ulog", "px4log"):
        return tuple(_px4(k)), ()
    return _ardupilot(k, flight)


def _mean(flight: Flight, name: str) -> float:
    """Mean of a channel while it is above a fifth of its highest; 0 where there is none."""
    if name not in flight:
        return 0.0
    values = np.abs(flight.values(name))
    values = values[np.isfinite(values)]
    running = values[values > 0.2 * values.max()] if values.size and values.max() > 0.0 else values[:0]
    return float(np.mean(running)) if running.size else 0.0


def _motors(flight: Flight) -> list[float]:
    """Mean speeds of the motors that tell theirs [Hz]."""
    names = [name for name in flight.channels if name.startswith("omega_motor_")]
    return [speed / (2.0 * np.pi) for name in names if (speed := _mean(flight, name)) > 0.0]


def _ardupilot(k: Mapping[str, float], flight: Flight) -> tuple[tuple[Filter, ...], tuple[str, ...]]:
    chain, untold = list[Filter](), list[str]()
    if (corner := k.get("INS_GYRO_FILTER", 0.0)) > 0.0:
        chain.append(Filter("INS_GYRO_FILTER", _GYRO, "low-pass", corner))
    for name in ("INS_HNTCH", "INS_HNTC2"):
        if k.get(f"{name}_ENABLE", 0.0) > 0.0 and k.get(f"{name}_FREQ", 0.0) > 0.0:
            notches, why = _harmonic(name, k, flight)
            chain += notches
            untold += [why] if why else []
    for word, axis in _AXES.items():
        for end, place in (("FLTT", _TARGET), ("FLTE", _ERROR), ("FLTD", _SLOPE), ("FILT", _ERROR)):
            if (corner := k.get(f"ATC_RAT_{word}_{end}", 0.0)) > 0.0:
                chain.append(
                    Filter(f"ATC_RAT_{word}_{end}", place, "low-pass", corner, axis, order=1, butterworth=False)
                )
    return tuple(chain), tuple(untold)


def _harmonic(name: str, k: Mapping[str, float], flight: Flight) -> tuple[list[Filter], str]:
    """The notches of a harmonic notch filter, where its mode set them on average, and what the log does not tell."""
    base, wide = k[f"{name}_FREQ"], k.get(f"{name}_BW", 0.5 * k[f"{name}_FREQ"])
    left = 10.0 ** (-k.get(f"{name}_ATT", 40.0) / 20.0)
    mode, reference = int(k.get(f"{name}_MODE", 1.0)), k.get(f"{name}_REF", 0.0)
    ratio, why = wide / base, ""
    sources = [base]
    if mode == 1 and reference > 0.0:
        throttle = _mean(flight, "mixer_collective")
        sources = [base * max(np.sqrt(throttle / reference), k.get(f"{name}_FM_RAT", 1.0))] if throttle else sources
    elif mode == 2 and (rotor := _mean(flight, "omega_rotor")):
        sources = [max(base, reference * rotor / (2.0 * np.pi))]
    elif mode == 3 and (motors := _motors(flight)):
        every = int(k.get(f"{name}_OPTS", 0.0)) & 2
        sources = [max(base, motor) for motor in (motors if every else [float(np.mean(motors))])]
    elif mode != 0 and (mode != 1 or reference > 0.0):
        why = f"{name} follows the {_NOTCH_MODES.get(mode, f'mode {mode}')}, which the log does not tell: shown at its "
        why += f"lowest frequency, {base:g} Hz"
    numbers = [n + 1 for n in range(16) if int(k.get(f"{name}_HMNCS", 3.0)) >> n & 1]
    notches = [
        Filter(f"{name} ({n} x)" if n > 1 else name, _GYRO, "notch", n * f, width=n * f * ratio, left=left)
        for f in sources
        for n in numbers
    ]
    return notches, why


def _low_pass(name: str, k: Mapping[str, float], kind: str, place: str) -> Filter | None:
    """A low-pass of Betaflight by its parameter's beginning; one that moves with the throttle at its lowest corner."""
    for ending in (f"{name}_dyn_hz_0", f"{name}_dyn_min_hz", f"{name}_static_hz", f"{name}_hz"):
        if (corner := k.get(ending, 0.0)) > 0.0:
            order, butterworth = {0: (1, False), 1: (2, True), 2: (2, False), 3: (3, False)}.get(
                int(k.get(kind, 0.0)), (1, False)
            )
            return Filter(ending, place, "low-pass", corner, order=order, butterworth=butterworth)
    return None


def _betaflight(k: Mapping[str, float], flight: Flight) -> tuple[tuple[Filter, ...], tuple[str, ...]]:
    chain, untold = list[Filter | None](), list[str]()
    for name, place in (("gyro_lpf1", _GYRO), ("gyro_lpf2", _GYRO), ("dterm_lpf1", _SLOPE), ("dterm_lpf2", _SLOPE)):
        old = name.replace("lpf1", "lowpass").replace("lpf2", "lowpass2")
        chain.append(_low_pass(name, k, f"{name}_type", place) or _low_pass(old, k, f"{old}_type", place))
    for stem, place in (("gyro_notch", _GYRO), ("dterm_notch", _SLOPE)):
        for ending in ("", "_0", "_1"):
            centre, cutoff = k.get(f"{stem}_hz{ending}", 0.0), k.get(f"{stem}_cutoff{ending}", 0.0)
            if centre > cutoff > 0.0:
                wide = (centre**2 - cutoff**2) / cutoff
                chain.append(Filter(f"{stem}_hz{ending}", place, "notch", centre, width=wide))
    harmonics = int(k.get("rpm_filter_harmonics", k.get("gyro_rpm_notch_harmonics", 0.0)))
    quality = k.get("rpm_filter_q", k.get("gyro_rpm_notch_q", 500.0)) / 100.0
    motors = _motors(flight) if harmonics else []
    for motor in motors:
        for n in range(1, harmonics + 1):
            chain.append(Filter(f"rpm_filter ({n} x)", _GYRO, "notch", n * motor, width=n * motor / quality))
    if harmonics and not motors:
        untold.append("the RPM filter's notches follow the motors, whose speed is not logged: left out")
    if k.get("dyn_notch_count", 0.0) > 0.0:
        untold.append(
            f"{int(k['dyn_notch_count'])} dynamic notches between {k.get('dyn_notch_min_hz', 0.0):g} and "
            f"{k.get('dyn_notch_max_hz', 0.0):g} Hz follow the noise, and the log does not tell where: left out"
        )
    return tuple(each for each in chain if each is not None), tuple(untold)


def _px4(k: Mapping[str, float]) -> list[Filter]:
    chain = []
    for name, place in (("IMU_GYRO_CUTOFF", _GYRO), ("IMU_DGYRO_CUTOFF", _SLOPE)):
        if (corner := k.get(name, 0.0)) > 0.0:
            chain.append(Filter(name, place, "low-pass", corner))
    for n in (0, 1):
        centre, wide = k.get(f"IMU_GYRO_NF{n}_FRQ", 0.0), k.get(f"IMU_GYRO_NF{n}_BW", 0.0)
        if centre > 0.0 and wide > 0.0:
            chain.append(Filter(f"IMU_GYRO_NF{n}_FRQ", _GYRO, "notch", centre, width=wide))
    return chain


def gyro_response(chosen: tuple[Filter, ...], frequency: Array) -> Array:
    """Gain of the gyro's filters, one behind the other, at frequencies [Hz]."""
    gain = np.ones(np.shape(frequency))
    for each in chosen:
        if each.place == _GYRO:
            gain = gain * np.abs(each.response(frequency))
    return gain
