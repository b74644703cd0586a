"""Handling qualities and loop margins read off a response of a flight or a model, with their random errors.

Bandwidth and phase delay of the attitude response after ADS-33E-PRF (2000), sec. 3.3.2.1; its boundaries are for
manned helicopters: for a small one scale frequencies with the square root of the size (Froude), and say so.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from swashplate.arrays import Array, Complex
from swashplate.errors import IdentificationError
from swashplate.identification.responses.frequency_response import FrequencyResponse, decibel


def crossing_delays(frequencies: ArrayLike, loop: ArrayLike) -> Array:
    """Delays of all opened inputs together at which an eigenvalue of L e^(-jwT) is -1 [s], ascending.

    MacFarlane and Postlethwaite (1977); of one loop phase margin over crossover, at every crossover. Good below a fifth
    of Nyquist's frequency, where a sampled loop with a delay is the loop times e^(-jwT).

    Args:
        frequencies: [rad/s], shape (n,), rising.
        loop: shape (n, m, m).
    """
    w, values = np.asarray(frequencies, dtype=np.float64), np.linalg.eigvals(np.asarray(loop))
    order = np.argsort(np.abs(values), axis=1)
    values = np.take_along_axis(values, order, axis=1)
    sizes = np.log(np.abs(values) + 1e-300)
    turned = np.mod(np.pi + np.angle(values), 2.0 * np.pi)
    delays = []
    for size, phase in zip(sizes.T, turned.T, strict=True):
        for i in np.flatnonzero(np.diff(np.sign(size))):
            share = size[i] / (size[i] - size[i + 1])
            at = w[i] * (w[i + 1] / w[i]) ** share
            ends = np.unwrap(phase[i : i + 2])
            delays.append(float(np.mod(ends[0] + share * (ends[1] - ends[0]), 2.0 * np.pi) / at))
    return np.sort(np.array(delays))


_STEP = 0.1
"""Of a random error, to either side, where its effect is read by differences."""


@dataclass(frozen=True)
class ReadNumber:
    """A number read off a response (NaN where there is none), with its standard deviation (NaN where unknown)."""

    value: float
    sigma: float = float("nan")

    def __repr__(self) -> str:
        if not np.isfinite(self.value):
            return "none"
        return f"{self.value:.4g}" + (f" +- {self.sigma:.2g}" if np.isfinite(self.sigma) else "")


def delay_words(seconds: float, sigma: float = float("nan"), *, digits: int = 3) -> str:
    """A delay in milliseconds, or in seconds from one on, with its standard deviation where that is known [s]."""
    if not np.isfinite(seconds):
        return "none" if np.isnan(seconds) else "any amount"
    scale, unit = (1.0, "s") if abs(seconds) >= 1.0 else (1e3, "ms")
    around = f" +- {scale * sigma:.2g}" if np.isfinite(sigma) else ""
    return f"{scale * seconds:.{digits}g}{around} {unit}"


@dataclass(frozen=True)
class Handling:
    """Bandwidth and phase delay of an attitude response.

    Attributes:
        bandwidth_phase: frequency of 45 degrees phase margin [rad/s].
        bandwidth_gain: frequency of 6 dB gain margin [rad/s].
        bandwidth: the lower of the two (rate command); the first for attitude command.
        omega_180: frequency of -180 degrees [rad/s].
        phase_delay: from the phase at twice omega_180 [s].
        phase_delay_line: from a coherence-weighted line between omega_180 and twice of it [s].
    """

    bandwidth_phase: ReadNumber
    bandwidth_gain: ReadNumber
    bandwidth: ReadNumber
    omega_180: ReadNumber
    phase_delay: ReadNumber
    phase_delay_line: ReadNumber


@dataclass(frozen=True)
class ResponseMargins:
    """Of a broken loop, the least of each kind where it crosses several times; NaN where it never does.

    Attributes:
        crossover: frequency of unit gain [rad/s].
        phase_margin: there [deg], -180 to 180; of an unstable loop with the whole turns that it is beyond.
        omega_180: frequency of -180 degrees, or whole turns further [rad/s]. gain_margin: there [dB].
        delay_margin: the least further delay that destabilises [s], at whichever crossing; 0 where a stable plant's
            loop is unstable already.
    """

    crossover: ReadNumber
    phase_margin: ReadNumber
    omega_180: ReadNumber
    gain_margin: ReadNumber
    delay_margin: ReadNumber

    def delay_in_words(self) -> str:
        """With its unit, or that the loop is unstable as it is."""
        r = self.delay_margin
        return "0, it is unstable" if r.value == 0.0 else delay_words(r.value, r.sigma, digits=4)


@dataclass(frozen=True)
class _Curve:
    """A response along log frequency: dB, unwrapped degrees, random error and coherence."""

    omega: Array
    gain: Array
    phase: Array
    error: Array
    coherence: Array

    def crossing(self, values: Array, level: float, *, last: bool = False) -> float | None:
        """Where a curve first (last) falls through a level [rad/s], straight in log frequency."""
        crossings = self.crossings(values, level, falling=True)
        return None if not crossings else crossings[-1 if last else 0]

    def crossings(self, values: Array, level: float, *, falling: bool = False) -> list[float]:
        """Everywhere that a curve passes a level, or falls through it [rad/s]."""
        above = values >= level
        passes = above[:-1] & ~above[1:] if falling else above[:-1] != above[1:]
        crossings = []
        for k in np.flatnonzero(passes):
            share = (values[k] - level) / (values[k] - values[k + 1])
            crossings.append(float(self.omega[k] * (self.omega[k + 1] / self.omega[k]) ** share))
        return crossings

    def at(self, values: Array, omega: float) -> float:
        return float(np.interp(np.log(omega), np.log(self.omega), values))

    def slope(self, values: Array, omega: float) -> float:
        """Derivative over omega, from a tenth of an octave either way."""
        low, high = max(omega / 2**0.1, self.omega[0]), min(omega * 2**0.1, self.omega[-1])
        return float((self.at(values, high) - self.at(values, low)) / (high - low))

    def sigma(self, omega: float, *, gain: bool = False) -> float:
        """Standard deviation of a crossing [rad/s]: the random error over the curve's slope."""
        error = self.at(self.error, omega)
        spread = 20.0 * np.log10(1.0 + error) if gain else np.degrees(error)
        slope = abs(self.slope(self.gain if gain else self.phase, omega))
        return float(spread / slope) if slope > 0.0 else float("nan")


def _curve(omega: Array, h: Complex, error: Array | None, coherence: Array | None) -> _Curve:
    known = np.isfinite(h)
    if known.sum() < 4:
        raise IdentificationError("the response has fewer than four points: nothing can be read off it.")
    omega = np.asarray(omega, dtype=np.float64)[known]
    nothing = np.zeros(omega.size)
    return _Curve(
        omega,
        np.asarray(decibel(h[known])),
        np.degrees(np.unwrap(np.angle(h[known]))),
        nothing + np.nan if error is None else error[known],
        nothing + 1.0 if coherence is None else coherence[known],
    )


def _attitude_phase(curve: _Curve) -> _Curve:
    """The phase shifted by whole turns so that the mid-band lies between -270 and 90 degrees; a sign costs 180."""
    middle = float(np.median(curve.phase[: max(1, curve.phase.size // 3)]))
    turn = 360.0 * np.ceil((middle - 90.0) / 360.0)
    return _Curve(curve.omega, curve.gain, curve.phase - turn, curve.error, curve.coherence)


def handling_qualities(
    omega: Array,
    attitude: Complex,
    *,
    error: Array | None = None,
    coherence: Array | None = None,
    command: str = "rate",
) -> Handling:
    """Bandwidth and phase delay of the response of an attitude to the pilot's command.

    Args:
        omega: [rad/s].
        attitude: H; of a rate response, divide by 1j omega first (`attitude_of`). Its sign must be the pilot's: a
            positive command gives a positive attitude.
        error: random errors; coherence: weights of the line. None for a model.
        command: "rate" or "attitude": which bandwidth counts.

    Raises:
        IdentificationError: where the response does not reach -180 degrees or is too short above it.
    """
    curve = _attitude_phase(_curve(omega, attitude, error, coherence))
    w180 = curve.crossing(curve.phase, -180.0)
    if w180 is None:
        raise IdentificationError(
            f"the phase does not fall through -180 degrees (it ends at {curve.phase[-1]:.0f} at "
            f"{curve.omega[-1] / 2 / np.pi:.3g} Hz): no bandwidth can be read off.",
            hint="Sweep to higher frequencies, or read it off the model.",
        )
    s180 = curve.sigma(w180)
    by_phase = curve.crossing(curve.phase, -135.0)
    level = curve.at(curve.gain, w180) + 6.0
    by_gain = curve.crossing(np.where(curve.omega <= w180, curve.gain, -np.inf), level, last=True)
    phase_reading = ReadNumber(by_phase, curve.sigma(by_phase)) if by_phase else ReadNumber(float("nan"))
    gain_reading = ReadNumber(by_gain, curve.sigma(by_gain, gain=True)) if by_gain else ReadNumber(float("nan"))
    both = [r for r in (phase_reading, gain_reading) if np.isfinite(r.value)]
    counted = phase_reading if command == "attitude" or not both else min(both, key=lambda r: r.value)
    two_point, line = _phase_delays(curve, w180)
    return Handling(phase_reading, gain_reading, counted, ReadNumber(w180, s180), two_point, line)


def _phase_delays(curve: _Curve, w180: float) -> tuple[ReadNumber, ReadNumber]:
    nothing = ReadNumber(float("nan"))
    if curve.omega[-1] < 1.2 * w180:
        return nothing, nothing
    two_point = nothing
    if curve.omega[-1] >= 2.0 * w180:
        lag = -(curve.at(curve.phase, 2.0 * w180) + 180.0)
        sigma = np.degrees(curve.at(curve.error, 2.0 * w180)) / (57.3 * 2.0 * w180)
        two_point = ReadNumber(lag / (57.3 * 2.0 * w180), float(sigma))
    inside = (curve.omega >= w180) & (curve.omega <= 2.0 * w180)
    if inside.sum() < 3:
        return two_point, nothing
    # Through (omega_180, -180): the slope is twice the phase delay of an integrator with that delay, as by two points.
    x, y = curve.omega[inside] - w180, curve.phase[inside] + 180.0
    weight = curve.coherence[inside] ** 2
    total = float(weight @ x**2)
    slope = float(weight @ (x * y)) / total
    sigma = float(np.sqrt((weight * x) ** 2 @ np.degrees(curve.error[inside]) ** 2)) / total
    return two_point, ReadNumber(-slope / (57.3 * 2.0), sigma / (57.3 * 2.0))


def margins(omega: Array, loop: Complex, *, error: Array | None = None) -> ResponseMargins:
    """Crossover and margins of phase, gain and delay of a broken loop L with negative feedback.

    Args:
        omega: [rad/s].
        loop: L(j omega).
        error: its random error; None where it is not known.
    """
    curve, delay = _attitude_phase(_curve(omega, loop, error, None)), _delay_margin(omega, loop, error)
    unstable = delay.value == 0.0
    nothing = ReadNumber(float("nan"))
    pm = gm = cross = phase_cross = nothing

    def over(w: float) -> float:
        """Degrees above -180; of an unstable loop with the turns that it is beyond them."""
        degrees = curve.at(curve.phase, w) + 180.0
        return degrees if unstable else _wrapped(degrees)

    margin = [(abs(over(w)), w) for w in curve.crossings(curve.gain, 0.0)]
    if margin:
        at = min(margin)[1]
        cross = ReadNumber(at, curve.sigma(at, gain=True))
        value = over(at)
        # Along the curve the phase at unit gain also moves as the crossing does.
        turn = curve.slope(curve.phase, at) * curve.sigma(at, gain=True)
        pm = ReadNumber(value, float(np.hypot(np.degrees(curve.at(curve.error, at)), turn)))
    turns = range(int(np.floor(curve.phase.min() / 360.0)) - 1, int(np.ceil(curve.phase.max() / 360.0)) + 1)
    room = [(abs(curve.at(curve.gain, w)), w) for k in turns for w in curve.crossings(curve.phase, 180.0 + 360.0 * k)]
    if room:
        # Where it is unstable already, the gain that has to go.
        lost = unstable or pm.value < 0.0 if margin else float(np.median(curve.gain)) > 0.0
        at = (min(room) if not lost else min((-curve.at(curve.gain, w), w) for _, w in room))[1]
        phase_cross = ReadNumber(at, curve.sigma(at))
        slide = curve.slope(curve.gain, at) * curve.sigma(at)
        spread = 20.0 * np.log10(1.0 + curve.at(curve.error, at))
        gm = ReadNumber(-curve.at(curve.gain, at), float(np.hypot(spread, slide)))
    return ResponseMargins(cross, pm, phase_cross, gm, delay)


def _delay_margin(omega: Array, loop: Complex, error: Array | None) -> ReadNumber:
    """With what the random error makes of it, by its part along the loop and its part across."""
    value = _least_delay(omega, loop)
    if error is None or not value > 0.0:
        return ReadNumber(value)
    step = _STEP * error
    stepped = [_least_delay(omega, loop * np.exp(way * step)) for way in (1.0, -1.0, 1j, -1j)]
    return ReadNumber(value, float(np.hypot(stepped[0] - stepped[1], stepped[2] - stepped[3]) / (2.0 * _STEP)))


def _least_delay(omega: Array, loop: Complex) -> float:
    """[s]; NaN where the gain never is one, 0 where Nyquist's count of a stable plant says unstable."""
    curve = _attitude_phase(_curve(omega, loop, None, None))
    # Net passes through -180 degrees (and whole turns further) with a gain above one; the start counts from the first.
    turns, above = np.floor((curve.phase + 180.0) / 360.0), curve.gain > 0.0
    if turns[0] * above[0] + np.sum(np.diff(turns)[above[:-1] & above[1:]]) != 0.0:
        return 0.0
    delays = crossing_delays(curve.omega, np.asarray(loop)[np.isfinite(loop)][:, None, None])
    return float(delays[0]) if delays.size else float("nan")


def _wrapped(degrees: float) -> float:
    return -((180.0 - degrees) % 360.0) + 180.0


def attitude_of(responses: FrequencyResponse, rate: str, input: str) -> tuple[Array, Complex, Array, Array]:
    """Frequencies, attitude response, error and coherence from a measured rate response, over its coherent band."""
    h, coherence, error = responses.pair(rate, input)
    band = responses.band(rate, input)
    if band is None:
        raise IdentificationError("has no coherent band.", channel=f"{rate} / {input}")
    inside = (responses.omega >= band[0]) & (responses.omega <= band[1])
    omega = responses.omega[inside]
    return omega, np.asarray(h[inside] / (1j * omega)), error[inside], coherence[inside]
