"""Units that logs use, and their conversion to the SI units and radians inside."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from swashplate.errors import UnitError

_FOOT = 0.3048  # m, exact (international foot)
_INCH = 0.0254  # m, exact
_MILE = 1609.344  # m, exact (international mile)
_GRAVITY = 9.80665  # m/s^2, exact (standard gravity)
_TURN = 2.0 * math.pi
_DEGREE = math.pi / 180.0

# unit -> (the unit inside, what a value is multiplied by)
_UNITS: dict[str, tuple[str, float]] = {
    "s": ("s", 1.0),
    "ms": ("s", 1e-3),
    "us": ("s", 1e-6),
    "ns": ("s", 1e-9),
    "min": ("s", 60.0),
    "h": ("s", 3600.0),
    "m": ("m", 1.0),
    "cm": ("m", 1e-2),
    "mm": ("m", 1e-3),
    "in": ("m", _INCH),
    "ft": ("m", _FOOT),
    "m/s": ("m/s", 1.0),
    "cm/s": ("m/s", 1e-2),
    "mm/s": ("m/s", 1e-3),
    "ft/s": ("m/s", _FOOT),
    "km/h": ("m/s", 1.0 / 3.6),
    "mph": ("m/s", _MILE / 3600.0),
    "kn": ("m/s", 1852.0 / 3600.0),
    "m/s^2": ("m/s^2", 1.0),
    "ft/s^2": ("m/s^2", _FOOT),
    "g": ("m/s^2", _GRAVITY),
    "rad": ("rad", 1.0),
    "mrad": ("rad", 1e-3),
    "deg": ("rad", _DEGREE),
    "rad/s": ("rad/s", 1.0),
    "deg/s": ("rad/s", _DEGREE),
    "rpm": ("rad/s", _TURN / 60.0),
    "rad/s^2": ("rad/s^2", 1.0),
    "deg/s^2": ("rad/s^2", _DEGREE),
    "1": ("1", 1.0),
    "%": ("1", 1e-2),
    "V": ("V", 1.0),
    "mV": ("V", 1e-3),
    "A": ("A", 1.0),
    "mA": ("A", 1e-3),
    "N": ("N", 1.0),
    "mN": ("N", 1e-3),
    "N m": ("N m", 1.0),
    "N mm": ("N m", 1e-3),
    "mN m": ("N m", 1e-3),
    "W": ("W", 1.0),
    "kg": ("kg", 1.0),
    "Hz": ("Hz", 1.0),
}
_SPELLINGS = {
    "sec": "s", "second": "s", "seconds": "s", "millisecond": "ms", "milliseconds": "ms", "msec": "ms",
    "microsecond": "us", "microseconds": "us", "usec": "us", "µs": "us", "nanosecond": "ns", "nanoseconds": "ns",
    "meter": "m", "meters": "m", "metres": "m", "millimeters": "mm", "centimeters": "cm", "feet": "ft", "inches": "in",
    "fps": "ft/s", "ft/sec": "ft/s", "m/sec": "m/s", "m/s2": "m/s^2", "m/s²": "m/s^2", "m/s/s": "m/s^2",
    "kt": "kn", "kts": "kn", "knots": "kn", "kph": "km/h", "mi/h": "mph",
    "m s^-1": "m/s", "m s^-2": "m/s^2",
    "degree": "deg", "degrees": "deg", "°": "deg", "radian": "rad", "radians": "rad",
    "deg/sec": "deg/s", "°/s": "deg/s", "dps": "deg/s", "rad/sec": "rad/s", "r/min": "rpm", "1/min": "rpm",
    "rad/s2": "rad/s^2", "rad/s²": "rad/s^2", "deg/s2": "deg/s^2", "deg/s²": "deg/s^2", "°/s²": "deg/s^2",
    "rad s^-1": "rad/s", "deg s^-1": "deg/s", "rad s^-2": "rad/s^2", "deg s^-2": "deg/s^2",
    "rad/sec2": "rad/s^2", "deg/sec2": "deg/s^2",
    "-": "1", "percent": "%", "volt": "V", "volts": "V", "v": "V", "amp": "A", "amps": "A",
}  # fmt: skip


def _entry(unit: str) -> tuple[str, float] | None:
    spelled = unit.strip()
    entry = _UNITS.get(spelled) or _UNITS.get(_SPELLINGS.get(spelled, _SPELLINGS.get(spelled.lower(), "")))
    if entry is None and spelled.startswith("-") and (unsigned := _entry(spelled[1:])) is not None:
        entry = (unsigned[0], -unsigned[1])  # a sensor or servo that counts the other way
    return entry


def known() -> dict[str, tuple[str, float]]:
    """Every unit by its usual spelling, with the unit inside and what a value is multiplied by."""
    return dict(_UNITS)


def usual(unit: str) -> str:
    """The usual spelling of a unit ("°/s" is deg/s); the unit itself where it is not known."""
    spelled = unit.strip()
    return spelled if spelled in _UNITS else _SPELLINGS.get(spelled, _SPELLINGS.get(spelled.lower(), unit))


def is_known(unit: str) -> bool:
    """Whether `unit` can be converted."""
    return _entry(unit) is not None


def inside_unit(unit: str) -> str:
    """The SI unit (or rad, or "1") that `unit` is converted to; `unit` itself where it is not known."""
    entry = _entry(unit)
    return unit if entry is None else entry[0]


def to_inside(
    values: ArrayLike,
    unit: str,
    *,
    expected: str = "",
    channel: str | None = None,
    where: str | None = None,
) -> NDArray[np.float64]:
    """Values in the unit inside.

    Args:
        values: numbers in `unit`, any shape.
        unit: one of `m mm ft deg deg/s rpm g % ms ...`.
        expected: the unit inside that the channel must have ("" where any will do).
        channel, where: what the error names.

    Raises:
        UnitError: where the unit is not known, or measures something else than `expected`.
    """
    entry = _entry(unit)
    if entry is None:
        raise UnitError(
            f"unit '{unit}' is not known; known are {' '.join(_UNITS)}.",
            where=where,
            channel=channel,
            hint="Correct the unit, or give another in a mapping file (with a factor where needed).",
        )
    inside, factor = entry
    if expected and inside != expected:
        raise UnitError(
            f"unit '{unit}' is a unit of [{inside}], expected one of [{expected}].",
            where=where,
            channel=channel,
            hint="Correct the unit in the file, in `units`, or in the mapping file.",
        )
    numbers = np.asarray(values, dtype=np.float64)
    if factor == 1.0:
        return numbers
    with np.errstate(over="ignore"):  # the reader refuses what is not finite, and names it
        return np.asarray(numbers * factor)
