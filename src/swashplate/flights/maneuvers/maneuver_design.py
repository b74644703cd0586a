"""Is a maneuver worth flying? The design rules of sweeps, multisines, sines and doublets, each with what was found.

Sweep rules: Tischler and Remple (2012), ch. 5; multisine rules: Morelli (2003).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import xarray as xr

from swashplate.errors import ManeuverError
from swashplate.flights.flight import stream
from swashplate.flights.maneuvers.ardupilot_chirp import Chirp
from swashplate.flights.maneuvers.multisine import dealt, relative_peak_factor
from swashplate.flights.maneuvers.series import FADE, SWEEP_C1, Maneuver

_PER_FREQUENCY = 25.0  # samples a period: the filter's corner at 5 times the frequency, sampled at 5 times the corner
_EXCITED = 0.1  # of the largest power: the band that a doublet or 3-2-1-1 excites
_SIGNAL_TO_NOISE = 10.0


@dataclass(frozen=True)
class RuleCheck:
    """A design rule and what a maneuver makes of it, in words; `met` says whether it is kept."""

    rule: str
    found: str
    expected: str
    met: bool


@dataclass(frozen=True)
class ExpectedResponse:
    """What is known of the response that is to be measured; None where it is not.

    Attributes:
        noise: standard deviation of what the output shows beside the response (sensor noise, gusts), in its unit.
        gain: output over input where the response is weakest in the band.
        coherence: wanted there.
        bandwidth: of the response [Hz]; f180: where its phase is -180 deg [Hz].
    """

    noise: float | None = None
    gain: float | None = None
    coherence: float = 0.8
    bandwidth: float | None = None
    f180: float | None = None


def sampled(maneuver: Maneuver, *, rate: float, chirp: Chirp | None = None) -> xr.Dataset:
    """The maneuver as one stream at `rate` [Hz], one channel an axis, from its first to its last moment.

    Args:
        maneuver: what is flown.
        rate: [Hz].
        chirp: ArduPilot's own schedule of a sweep, where that is what will be flown.

    Raises:
        ManeuverError: a rate that is not positive.
    """
    if not (np.isfinite(rate) and rate > 0.0):
        raise ManeuverError(f"a sample rate of {rate:g} Hz makes no sense.", hint="Give a positive one, e.g. 100.")
    time = np.arange(int(np.floor(maneuver.duration * rate + 1e-6)) + 1) / rate
    signals = {maneuver.axes[0]: chirp.signal(time)} if chirp is not None else maneuver.signals(time)
    unit = chirp.unit if chirp is not None else "1"
    return stream(time, signals, dict.fromkeys(signals, unit))


def full_until(maneuver: Maneuver, *, chirp: Chirp | None = None) -> float:
    """Frequency [Hz] up to which a sweep has its full amplitude: it fades out beyond; a multisine's highest.

    Raises:
        ManeuverError: a maneuver without a band.
    """
    if maneuver.band is None or maneuver.kind == "sine":
        raise ManeuverError(f"a {maneuver.kind} has no band.", hint="Ask it of a sweep or a multisine.")
    low, high = maneuver.band
    if chirp is not None:
        return float(chirp.frequency(np.asarray(chirp.record - chirp.fade_out)))
    if maneuver.kind == "sweep":
        return float(low + (high - low) * np.expm1(SWEEP_C1 * (1.0 - FADE)) / np.expm1(SWEEP_C1))
    return high


def input_density(maneuver: Maneuver, *, chirp: Chirp | None = None) -> float:
    """One-sided power density of a sweep or multisine where it is least at full amplitude [unit^2/Hz].

    A sweep of amplitude A passes f at df/dt: A^2/2 over the record's time there, which is least at the highest
    frequency before it fades out. A multisine has its mean square spread over its band.
    """
    top = full_until(maneuver, chirp=chirp)
    low, high = maneuver.band or (0.0, 0.0)
    if chirp is not None:
        share = 1.0 - chirp.dwell / chirp.record
        return float(0.5 * chirp.magnitude**2 * share / (top * np.log(high / low)))
    if maneuver.kind == "sweep":
        return float(0.5 * maneuver.amplitude**2 / (SWEEP_C1 * (top - low + (high - low) / np.expm1(SWEEP_C1))))
    time = np.arange(int(20.0 * high * maneuver.duration)) / (20.0 * high)
    return min(float(np.mean(signal**2)) for signal in maneuver.signals(time).values()) / (high - low)


def predicted_coherence(
    maneuver: Maneuver, *, rate: float, noise: float, gain: float, chirp: Chirp | None = None
) -> float:
    """Least coherence in the band, before a sweep fades out: 1 / (1 + Gnn / (g^2 Gxx)) with white noise.

    Args:
        maneuver: a sweep or multisine.
        rate: [Hz].
        noise: standard deviation of the noise in the output, spread up to half the sample rate.
        gain: least output over input in the band.
        chirp: ArduPilot's schedule, where that is flown.
    """
    response = gain**2 * input_density(maneuver, chirp=chirp)
    return response / (response + 2.0 * noise**2 / rate) if response > 0.0 else 0.0


def checks(
    maneuver: Maneuver, *, rate: float, vehicle: ExpectedResponse | None = None, chirp: Chirp | None = None
) -> list[RuleCheck]:
    """The design rules of the maneuver's kind, kept or not.

    Args:
        maneuver: what is flown.
        rate: at which it is commanded and recorded [Hz].
        vehicle: what is known of the response; rules that need more are left out.
        chirp: ArduPilot's schedule of a sweep, where that is flown.
    """
    known = vehicle or ExpectedResponse()
    if maneuver.band is None:
        return _block_checks(maneuver, rate, known)
    low, high = maneuver.band
    per = rate / high
    rules = [
        RuleCheck(
            "sample rate", f"{per:.1f} samples a period of {high:g} Hz", "at least 25", per >= _PER_FREQUENCY - 1e-9
        )
    ]
    periods = maneuver.duration * low
    if maneuver.kind == "sine":
        integer = abs(periods - round(periods)) < 1e-6
        rules.append(
            RuleCheck("length", f"{periods:.4g} periods", "a whole number, at least 5", integer and periods > 4.999)
        )
        return rules
    if maneuver.kind == "sweep":
        rules.append(
            RuleCheck("length", f"{periods:.3g} periods of {low:g} Hz", "at least 4, better 5", periods > 3.999)
        )
        half = 0.5 * maneuver.duration * high
        rules.append(
            RuleCheck(
                "windows", f"half the record holds {half:.0f} periods of {high:g} Hz", "at least 20", half > 19.999
            )
        )
        flights = int(np.ceil(5.0 / periods - 1e-9))
        records = "1 record" if flights == 1 else f"{flights} records"
        rules.append(RuleCheck("averaging", f"{records} for 5 windows at {low:g} Hz", "that many flown", flights == 1))
    else:
        rules += _multisine_checks(maneuver, rate)
    rules += _band_checks(low, full_until(maneuver, chirp=chirp), known)
    if known.noise is not None and known.gain is not None:
        rules.append(_coherence_check(maneuver, rate, known, chirp))
    return rules


def _band_checks(low: float, top: float, known: ExpectedResponse) -> list[RuleCheck]:
    rules = []
    if known.bandwidth is not None:
        limit = 0.5 * known.bandwidth
        rules.append(
            RuleCheck("low end", f"{low:g} Hz", f"at most {limit:.3g} Hz, half the bandwidth", low <= limit + 1e-9)
        )
    if known.f180 is not None:
        limit = 2.0 * known.f180
        expected = f"at least {limit:.3g} Hz, twice that of -180 deg"
        rules.append(RuleCheck("high end", f"full amplitude up to {top:.3g} Hz", expected, top >= limit - 1e-9))
    return rules


def _coherence_check(maneuver: Maneuver, rate: float, known: ExpectedResponse, chirp: Chirp | None) -> RuleCheck:
    noise, gain = float(known.noise or 0.0), float(known.gain or 0.0)
    if not (0.0 < known.coherence < 1.0 and noise >= 0.0 and gain > 0.0):
        raise ManeuverError(
            f"noise {noise:g}, gain {gain:g} and a coherence of {known.coherence:g} make no sense together.",
            hint="Give a noise of zero or more, a positive gain and a coherence between 0 and 1.",
        )
    least = predicted_coherence(maneuver, rate=rate, noise=noise, gain=gain, chirp=chirp)
    ratio = known.coherence / (1.0 - known.coherence) * (1.0 - least) / least if least > 0.0 else np.inf
    needed = maneuver.amplitude * np.sqrt(ratio)
    expected = f"an amplitude of {needed:.3g} for {known.coherence:g}"
    where = f"least coherence {least:.2f}, at {full_until(maneuver, chirp=chirp):.3g} Hz"
    return RuleCheck("amplitude", f"{maneuver.amplitude:g}: {where}", expected, least >= known.coherence)


def _multisine_checks(maneuver: Maneuver, rate: float) -> list[RuleCheck]:
    low, high = maneuver.band or (0.0, 0.0)
    count = min(lines.size for lines in dealt(low, high, maneuver.duration, axes=len(maneuver.axes)))
    time = np.arange(round(maneuver.duration * rate)) / rate
    signals = np.stack(list(maneuver.signals(time).values()))
    periods = maneuver.duration * low
    rules = [
        RuleCheck("length", f"{periods:.3g} periods of {low:g} Hz", "at least 2", periods > 1.999),
        RuleCheck("harmonics", f"{count} an axis", "at least 10", count >= 10),
    ]
    peak = max(relative_peak_factor(signal) for signal in signals)
    rules.append(RuleCheck("peak factor", f"{peak:.2f}", "at most 1.2 (a sine has 1)", peak <= 1.2))
    if len(maneuver.axes) > 1:
        largest = float(np.max(np.abs(np.corrcoef(signals) - np.eye(len(signals)))))
        shown = "none" if largest < 1e-9 else f"{largest:.1g}"  # below that it is rounding
        rules.append(RuleCheck("orthogonal axes", f"correlation: {shown}", "at most 0.01", largest <= 0.01))
    return rules


def excited_band(maneuver: Maneuver) -> tuple[float, float]:
    """Band [Hz] in which the maneuver's power is at least a tenth of its largest (the zero end included)."""
    rate = 200.0 / maneuver.duration
    time = np.arange(200) / rate
    signal = next(iter(maneuver.signals(time).values()))
    power = np.abs(np.fft.rfft(signal, 1 << 14)) ** 2
    frequency = np.fft.rfftfreq(1 << 14, 1.0 / rate)
    top = int(np.argmax(power))
    strong = power >= _EXCITED * power[top]
    below, above = np.flatnonzero(~strong[:top]), np.flatnonzero(~strong[top:])
    first = int(below[-1]) + 1 if below.size else 0
    last = top + int(above[0]) - 1 if above.size else strong.size - 1
    return float(frequency[first]), float(frequency[last])


def _block_checks(maneuver: Maneuver, rate: float, known: ExpectedResponse) -> list[RuleCheck]:
    pieces = {"doublet": 2, "3211": 7}.get(maneuver.kind, 1)
    samples = maneuver.duration / pieces * rate
    integer = abs(samples - round(samples)) < 1e-6 * samples
    rules = [
        RuleCheck(
            "sample rate", f"{samples:.4g} samples a unit", "a whole number, at least 10", integer and samples > 9.99
        )
    ]
    low, high = excited_band(maneuver)
    if known.bandwidth is not None:
        inside = low <= known.bandwidth <= high
        expected = f"the mode at {known.bandwidth:g} Hz inside"
        rules.append(RuleCheck("band", f"excites {low:.2g} to {high:.2g} Hz", expected, inside))
    else:
        rules.append(RuleCheck("band", f"excites {low:.2g} to {high:.2g} Hz", "the mode of interest inside", True))
    if known.noise is not None and known.gain is not None:
        ratio = known.gain * maneuver.amplitude / known.noise if known.noise > 0.0 else np.inf
        rules.append(
            RuleCheck(
                "amplitude", f"signal to noise {ratio:.3g}", f"at least {_SIGNAL_TO_NOISE:g}", ratio >= _SIGNAL_TO_NOISE
            )
        )
    return rules
