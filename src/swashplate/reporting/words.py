"""Numbers and recorded steps as people say them."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

from swashplate.filtering.disturbances import SEPARATE
from swashplate.flights.provenance import ProcessingStep
from swashplate.identification.core.sources import DataSource


def value_words(value: float | None, sigma: float | None = None) -> str:
    """A number with the digits that its uncertainty leaves meaningful (four where that is unknown).

    With sigma, the last digit shown is the second significant digit of sigma, so that value and bound end alike.
    """
    if value is None or not math.isfinite(value):
        return "–"
    digits = 4
    if sigma is not None and math.isfinite(sigma) and sigma > 0.0 and value != 0.0:
        digits = min(6, max(2, math.floor(math.log10(abs(value))) - math.floor(math.log10(sigma)) + 2))
    return _short_exponent(f"{value:.{digits}g}")


def sigma_words(sigma: float | None) -> str:
    """A standard deviation with two significant digits."""
    return "–" if sigma is None or not math.isfinite(sigma) else _short_exponent(f"{sigma:.2g}")


def mode_words(eigenvalue: complex) -> str:
    """An eigenvalue as "-0.05 ± 4.2j 1/s"; rounding's own imaginary part is none."""
    oscillates = abs(eigenvalue.imag) > 1e-6 * abs(eigenvalue)
    return f"{eigenvalue.real:+.3g}{f' ± {abs(eigenvalue.imag):.3g}j' if oscillates else ''} 1/s"


def _short_exponent(text: str) -> str:
    """Exponents without their padding: 2.3e-05 becomes 2.3e-5; large round numbers without an exponent."""
    if "e" not in text:
        return text
    mantissa, exponent = text.split("e")
    power = int(exponent)
    return f"{float(text):.0f}" if 0 <= power < 5 else f"{mantissa}e{power}"


def noise_told(noise: Mapping[str, float]) -> dict[str, float]:
    """A noise model without the wind that was not asked for."""
    calm = () if noise.get("wind", 0.0) > 0.0 else ("wind", "tau_wind", "speed")
    shared = [name for name in SEPARATE if not noise.get(name, 0.0) > 0.0]
    return {name: float(value) for name, value in noise.items() if name not in (*calm, *shared)}


def percent(value: float, *, digits: int = 0) -> str:
    """A percentage, "–" where there is none; a huge one is not spelled out."""
    if not math.isfinite(value):
        return "–"
    return f"{value:.{digits}f}" if abs(value) < 1000.0 else ("< −999" if value < 0 else "> 999")


def listed(items: Iterable[str], *, most: int = 6) -> str:
    """ "a, b and c"; beyond `most` the rest is counted."""
    rows = list(items)
    if len(rows) > most:
        rows = [*rows[: most - 1], f"{len(rows) - most + 1} more"]
    return rows[0] if len(rows) == 1 else f"{', '.join(rows[:-1])} and {rows[-1]}" if rows else "none"


def counted(n: int, noun: str) -> str:
    """ "1 flight", "2 flights"."""
    return f"{n} {noun}{'' if n == 1 else 's'}"


def _outliers(d: Mapping[str, Any]) -> str:
    by_channel = {k: v for k, v in d.get("by_channel", {}).items() if v}
    total = sum(by_channel.values())
    where = listed([f"{name} {count}" for name, count in by_channel.items()], most=12)
    return f"Outliers beyond {d.get('threshold', '?')} robust standard deviations were removed: " + (
        f"{counted(total, 'sample')} ({where})." if total else "none was found."
    )


def _ground(d: Mapping[str, Any]) -> str:
    text = f"The flying part was kept, {d['start']:.2f} to {d['stop']:.2f} s"
    text += f" ({d['removed_seconds']:.2f} s removed)" if d.get("removed_seconds") else ""
    return f"{text}. Reason: {'; '.join(map(str, d['reasons']))}." if d.get("reasons") else f"{text}."


def _resample(d: Mapping[str, Any]) -> str:
    text = f"All channels were brought to {d['rate']:g} Hz"
    text += f" (logged at {d['native_rate']:.1f} Hz)" if "native_rate" in d else ""
    text += f", gaps of up to {1000 * d['max_gap']:.0f} ms bridged" if "max_gap" in d else ""
    if d.get("segments", 1) > 1:
        text += f"; longer gaps split the flight into {d['segments']} segments"
    if d.get("dropped_seconds"):
        text += f", {d['dropped_seconds']:.2f} s in pieces too short to use were dropped"
    return text + "."


def _lowpass(d: Mapping[str, Any]) -> str:
    phase = "zero-phase " if d.get("zero_phase") else ""
    order = d.get("order", "?")
    return f"A {phase}Butterworth low-pass of order {order} at {d['cutoff']:g} Hz went over all channels alike."


def _derive(d: Mapping[str, Any]) -> str:
    derived = [str(name) for name in d.get("derived", ())]
    taken = f" Gravity was taken as {d['gravity']:.4g} m/s²" if "az" in derived and "gravity" in d else ""
    why = ", the standard, because the log does not say it" if d.get("assumed") else ""
    return f"{listed(derived, most=12)} were derived from position and attitude.{f'{taken}{why}.' if taken else ''}"


def _between(d: Mapping[str, Any]) -> str:
    return f"The part from {d['start']:.2f} to {d['stop']:.2f} s was taken."


_STEPS: Mapping[str, Callable[[Mapping[str, Any]], str]] = {
    "remove_outliers": _outliers,
    "trim_ground": _ground,
    "resample": _resample,
    "lowpass": _lowpass,
    "derive": _derive,
    "between": _between,
    "observe": lambda d: f"Sensors were simulated: noise, gaps and outliers (seed {d.get('seed', '?')}).",
}


def step_words(step: ProcessingStep) -> str:
    """One step of a flight's history in words; a step that is not known is given with its numbers."""
    try:
        return _STEPS[step.operation](step.details)
    except (KeyError, TypeError, ValueError):
        return f"{step.operation}: {details_words(step.details)}"


def details_words(details: Mapping[str, Any], *, most: int = 400) -> str:
    """Details as "name = value" pairs, cut off where they get long."""
    text = ", ".join(f"{key} = {plain_words(value)}" for key, value in details.items()) or "no details"
    return text if len(text) <= most else f"{text[:most]} …"


def plain_words(value: Any) -> str:
    """A JSON-like value in one line; a path shows its last part only (reports travel between machines)."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if value is None:
        return "–"
    if isinstance(value, float):
        return value_words(value)
    if isinstance(value, Mapping):
        return "; ".join(f"{key} {plain_words(item)}" for key, item in value.items()) or "none"
    if isinstance(value, Sequence) and not isinstance(value, str):
        return ", ".join(plain_words(item) for item in value) or "none"
    text = str(value)
    return text.replace("\\", "/").rsplit("/", 1)[-1] if text.startswith(("/", "~")) or text[1:3] == ":\\" else text


def span_words(flight: DataSource) -> str:
    """Duration, pieces and rate of a flight."""
    if not flight.segments:
        return "–"
    seconds = sum(stop - start for start, stop in flight.segments)
    return f"{seconds:.1f} s in {counted(len(flight.segments), 'segment')} at {flight.rate:.0f} Hz"
