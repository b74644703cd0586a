"""Maneuvers for identification: sweep, multisine, sine, doublet, step, 3-2-1-1, pulse, as series to add on trim inputs.

A maneuver is described in one line, `kind:axis,...`, e.g. "sweep:pitch,0.5-8Hz,60s" or "doublet:roll,0.5s,0.2".
"""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from swashplate.arrays import Array
from swashplate.errors import ManeuverError
from swashplate.flights.maneuvers import multisine
from swashplate.registry import nearest

AXES = ("roll", "pitch", "yaw", "heave")
"""What a maneuver moves, where it names no input; which inputs that are is the vehicle's to say."""

DEFAULT_AMPLITUDE: Mapping[str, float] = {"roll": 0.2, "pitch": 0.2, "yaw": 0.005, "heave": 0.03}
"""Largest deflection [of the command's unit 1] where none is given."""

SWEEP_C1 = 4.0
"""How much longer a sweep stays at its low frequencies (Tischler and Remple 2012, sec. 5.11)."""
FADE = 0.05
"""Part of the record over which a sweep or multisine fades in, and out."""


@dataclass(frozen=True)
class Maneuver:
    """One excitation.

    Attributes:
        kind: one of `KINDS`.
        axes: the axes (or input names) that it moves; only a multisine moves several at once.
        duration: length [s]; of a doublet, 3-2-1-1, step or pulse the unit's length times its number of units.
        amplitude: largest deflection, in the unit of the command.
        band: lowest and highest frequency [Hz], for sweep and multisine; twice the same for a sine.
    """

    kind: str
    axes: tuple[str, ...]
    duration: float
    amplitude: float
    band: tuple[float, float] | None = None

    def signals(self, time: Array) -> dict[str, Array]:
        """The excitation of each axis at times [s] counted from its start; zero before and after."""
        time = np.asarray(time, dtype=np.float64)
        inside = (time >= 0.0) & (time < self.duration)
        shapes = KINDS[self.kind](self, time)
        return {
            axis: np.where(inside, self.amplitude * shape, 0.0) for axis, shape in zip(self.axes, shapes, strict=True)
        }

    def offsets(
        self,
        time: Array,
        *,
        inputs: Iterable[str],
        axes: Mapping[str, Mapping[str, float]] | None = None,
        without: Collection[str] = (),
    ) -> dict[str, Array]:
        """What to add to each input at times [s] counted from the maneuver's start, leaving out some of its axes.

        Args:
            time: [s].
            inputs: of the vehicle.
            axes: which inputs an axis moves, and by what share: `Vehicle.stick_axes`. What is no axis is an input.
            without: axes that somebody else moves.

        Raises:
            ManeuverError: where an axis moves an input that the vehicle does not have.
        """
        names = tuple(inputs)
        added = {name: np.zeros(np.shape(time)) for name in names}
        for axis, signal in self.signals(time).items():
            if axis in without:
                continue
            for name, share in (axes or {}).get(axis, {axis: 1.0}).items():
                if name not in added:
                    known = (*(axes or {}), *names)
                    raise ManeuverError(
                        f"the vehicle has no axis and no input '{name}'.",
                        channel=axis,
                        hint=" ".join(filter(None, (nearest(axis, known), f"It has {', '.join(known)}."))),
                    )
                added[name] = added[name] + share * signal
        return added


def _sweep(maneuver: Maneuver, time: Array) -> list[Array]:
    """Exponential frequency schedule with fades (Tischler and Remple 2012, eqs 5.15 to 5.17)."""
    low, high = (2.0 * np.pi * f for f in _band(maneuver))
    duration, rate = maneuver.duration, SWEEP_C1 / maneuver.duration
    # The book's C2 = 0.0187 is this number rounded; exact, the sweep ends at the highest frequency.
    c2 = 1.0 / np.expm1(SWEEP_C1)
    inside = np.clip(time, 0.0, duration)
    phase = low * inside + (high - low) * c2 * (np.expm1(rate * inside) / rate - inside)
    return [_fades(time, duration) * np.sin(phase)]


def _multisine(maneuver: Maneuver, time: Array) -> list[Array]:
    """Orthogonal multisines of least peak; not faded: a whole period repeats without a jump."""
    low, high = _band(maneuver)
    harmonics = multisine.dealt(low, high, maneuver.duration, axes=len(maneuver.axes))
    if min(lines.size for lines in harmonics) < 2:
        raise ManeuverError(
            f"has {sum(one.size for one in harmonics)} harmonics in {low:g}-{high:g} Hz for {len(maneuver.axes)} axes.",
            hint="Make it longer or the band wider.",
        )
    return [multisine.wave(lines, time, duration=maneuver.duration) for lines in harmonics]


def _sine(maneuver: Maneuver, time: Array) -> list[Array]:
    """One frequency, from zero."""
    return [np.sin(2.0 * np.pi * _band(maneuver)[0] * time)]


def _units(*signs: float) -> Callable[[Maneuver, Array], list[Array]]:
    """Blocks of equal length and the given signs."""

    def blocks(maneuver: Maneuver, time: Array) -> list[Array]:
        unit = maneuver.duration / len(signs)
        number = np.clip(np.floor(time / unit + 1e-9).astype(int), 0, len(signs) - 1)
        return [np.asarray(signs)[number]]

    blocks.units = len(signs)  # pyrefly: ignore[missing-attribute]
    return blocks


def _nothing(maneuver: Maneuver, time: Array) -> list[Array]:
    """No axis is moved."""
    return []


HOVER = "hover"
"""The kind that moves nothing: the time that a controller is to hold what it was told."""
KINDS: Mapping[str, Callable[[Maneuver, Array], list[Array]]] = {
    "sweep": _sweep,
    "multisine": _multisine,
    "sine": _sine,
    "doublet": _units(1.0, -1.0),
    "step": _units(1.0),
    "pulse": _units(1.0),
    "3211": _units(1.0, 1.0, 1.0, -1.0, -1.0, 1.0, -1.0),
    HOVER: _nothing,
}
"""Shapes of unit amplitude by kind; "3211" is DLR's 3-2-1-1 (Jategaonkar 2015, sec. 2.3)."""


def _fades(time: Array, duration: float) -> Array:
    fade = FADE * duration
    edge = np.clip(np.minimum(time, duration - time) / fade, 0.0, 1.0)
    return np.asarray(0.5 - 0.5 * np.cos(np.pi * edge))


def _band(maneuver: Maneuver) -> tuple[float, float]:
    if maneuver.band is None:
        raise ManeuverError(f"a {maneuver.kind} needs a frequency band.", hint="Add it, e.g. 0.5-8Hz.")
    return maneuver.band


_NUMBER = r"(\d+(?:\.\d*)?|\.\d+)"
_BAND = re.compile(rf"{_NUMBER}-{_NUMBER}\s*Hz", re.IGNORECASE)
_TONE = re.compile(rf"{_NUMBER}\s*Hz", re.IGNORECASE)
_SECONDS = re.compile(rf"{_NUMBER}\s*s", re.IGNORECASE)
_AMPLITUDE = re.compile(_NUMBER)
_ITEMS = (("band", _BAND), ("band", _TONE), ("time", _SECONDS), ("amplitude", _AMPLITUDE))
_EXAMPLE = 'Examples: "sweep:pitch,0.5-8Hz,60s", "doublet:roll,0.5s,0.2", "multisine:roll+pitch,0.2-8Hz,30s,0.15".'


def parse(text: str) -> Maneuver:
    """A maneuver from its description `kind:axes,items`.

    Items, in any order: a band "0.5-8Hz" (sweep, multisine) or a frequency "2Hz" (sine), a time "60s" (the record of
    these three, one unit of a doublet or 3-2-1-1, the length of a step or pulse), an amplitude "0.3" (optional).
    Several axes of a multisine are joined by "+". "hover:20s" moves nothing for so long.

    Raises:
        ManeuverError: saying which word was not understood or is missing, with examples.
    """
    kind, colon, rest = text.strip().partition(":")
    kind = {"3-2-1-1": "3211", "collective": "heave"}.get(kind.strip().lower(), kind.strip().lower())
    if not colon or kind not in KINDS:
        raise ManeuverError(f"'{text}' does not begin with one of {', '.join(KINDS)} and a colon.", hint=_EXAMPLE)
    if kind == HOVER:
        return _hover(text, rest.strip())
    axes_text, *items = (item.strip() for item in rest.split(","))
    axes = tuple("heave" if axis.strip() == "collective" else axis.strip() for axis in axes_text.split("+"))
    if not all(re.fullmatch(r"[a-z][a-z0-9_]*", axis) for axis in axes):
        raise ManeuverError(f"'{axes_text}' is no axis; expected {', '.join(AXES)} or an input's name.", hint=_EXAMPLE)
    if len(set(axes)) != len(axes):
        raise ManeuverError(f"'{axes_text}' names an axis twice.", hint="Name each once.")
    if len(axes) > 1 and kind != "multisine":
        raise ManeuverError(f"a {kind} moves one axis, found '{axes_text}'.", hint="Only a multisine moves several.")
    said: dict[str, tuple[float, ...]] = {}
    for item in items:
        what, match = next(((what, m) for what, form in _ITEMS if (m := form.fullmatch(item))), ("", None))
        if match is None:
            raise ManeuverError(f"'{item}' in '{text}' is no band, time or amplitude.", hint=_EXAMPLE)
        if what in said:
            raise ManeuverError(f"'{text}' says its {what} twice.", hint=f"Leave out '{item}' or the other.")
        said[what] = tuple(map(float, match.groups()))
    band = said.get("band")
    (seconds,) = said.get("time", (None,))
    (amplitude,) = said.get("amplitude", (min(DEFAULT_AMPLITUDE.get(axis, 0.1) for axis in axes),))
    return _checked(text, kind, axes, None if band is None else (band[0], band[-1]), seconds, amplitude)


def _hover(text: str, rest: str) -> Maneuver:
    """`hover:20s`."""
    match = _SECONDS.fullmatch(rest)
    if match is None or not float(match[1]) > 0.0:
        raise ManeuverError(f"'{text}' says no time alone.", hint='A hover moves nothing: "hover:20s".')
    return Maneuver(HOVER, (), float(match[1]), 0.0)


def _checked(
    text: str,
    kind: str,
    axes: tuple[str, ...],
    band: tuple[float, float] | None,
    seconds: float | None,
    amplitude: float,
) -> Maneuver:
    """The maneuver, if it keeps the rules of its kind."""
    if not seconds:
        raise ManeuverError(
            f"'{text}' says no time." if seconds is None else f"'{text}' lasts no time.", hint="Say it, e.g. 60s."
        )
    if not amplitude > 0.0:
        raise ManeuverError(f"'{text}' has an amplitude of {amplitude:g}.", hint="Give a positive one or none.")
    banded = kind in ("sweep", "multisine", "sine")
    if banded != (band is not None):
        expected = (
            "needs a band, e.g. 0.5-8Hz (a sine: one frequency, 2Hz)."
            if banded
            else "has no band; give the length of one unit, e.g. 0.5s."
        )
        raise ManeuverError(f"a {kind} {expected}", hint=_EXAMPLE)
    if band is not None:
        low, high = band
        if kind == "sine" and not 0.0 < low == high:
            raise ManeuverError(f"a sine has one frequency above zero, found {low:g}-{high:g} Hz.", hint=_EXAMPLE)
        if kind != "sine" and not 0.0 < low < high:
            raise ManeuverError(f"the band {low:g}-{high:g} Hz does not rise from above zero.", hint=_EXAMPLE)
        if kind == "sweep" and seconds * low < 4.0:
            raise ManeuverError(
                f"{seconds:g} s hold {seconds * low:.1f} periods of {low:g} Hz, expected at least 4.",
                hint=f"Fly {4.0 / low:g} s or start at {4.0 / seconds:.2g} Hz (Tischler and Remple 2012, ch. 5).",
            )
    units = int(getattr(KINDS[kind], "units", 1))
    return Maneuver(kind, axes, seconds * units, amplitude, band)
