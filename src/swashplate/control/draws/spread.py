"""What many flights did: how many stayed within stated limits, how far the others went, and which was worst."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from swashplate.arrays import Array
from swashplate.errors import ControllerError
from swashplate.simulation.closed_loop_batch import Batch
from swashplate.simulation.trim import Trim
from swashplate.text_table import text_table

PERCENTILES = (5.0, 50.0, 95.0, 100.0)
_DEGREES = math.degrees(1.0)
_HUGE = 1e300
"""Stands for infinity where percentiles are interpolated."""

SHOWN: Mapping[str, tuple[str, float]] = {
    "lean": ("deg", _DEGREES),
    "rate": ("deg/s", _DEGREES),
    "place": ("m", 1.0),
    "height": ("m", 1.0),
    "heading": ("deg", _DEGREES),
}
"""Limits by name: the unit that they are shown and given in, and how many of it a unit of SI is."""


@dataclass(frozen=True)
class Limits:
    """Beyond which a flight counts as lost, whatever became of it later; infinity does not judge.

    The defaults are a small helicopter's that is to hold a place in a room or a yard: what a safety pilot would take
    over at. They are a choice, not a standard's.

    Attributes:
        lean: angle of the rotor's axis from where it stands in the trim [rad].
        rate: size of the body rates [rad/s].
        place: level distance from the place [m].
        height: above or below it [m].
        heading: away from the one at the start, turns counted [rad].
    """

    lean: float = math.radians(45.0)
    rate: float = math.radians(360.0)
    place: float = 2.0
    height: float = 1.0
    heading: float = math.radians(45.0)

    def __post_init__(self) -> None:
        for name, value in asdict(self).items():
            if not value > 0.0:
                raise ControllerError(f"is {value:g}, expected a positive number.", channel=f"limit of {name}")

    def summary_text(self) -> str:
        """The limits in the units that they are shown in."""
        values = asdict(self)
        listed = [f"{n} {values[n] * f:g} {u}" for n, (u, f) in SHOWN.items() if math.isfinite(values[n])]
        return ", ".join(listed) or "none"


@dataclass(frozen=True)
class Spread:
    """What many flights did.

    Attributes:
        limits: beyond which a flight is lost.
        values: by limit's name the largest of every flight [rad, rad/s, m], shape (flights,); infinite where it
            diverged.
        place_rms: of the level distance [m], shape (flights,).
        lost_after: when each was first beyond a limit [s], infinite where it never was, shape (flights,).
        worst: number of the flight that went furthest beyond a limit; without lost ones furthest from the place.
            Replay it by `Batch.flight`.
    """

    limits: Limits
    values: Mapping[str, Array]
    place_rms: Array
    lost_after: Array
    worst: int
    percentiles: tuple[float, ...] = field(default=PERCENTILES)

    @property
    def flights(self) -> int:
        """How many."""
        return len(self.lost_after)

    @property
    def lost(self) -> int:
        """How many were beyond a limit or diverged."""
        return int(np.sum(np.isfinite(self.lost_after)))

    @property
    def lost_by(self) -> dict[str, int]:
        """How many were beyond each limit; a flight may be beyond several."""
        limits = asdict(self.limits)
        return {name: int(np.sum(self.values[name] > limits[name])) for name in SHOWN}

    @property
    def figures(self) -> dict[str, tuple[float, ...]]:
        """Percentiles over all flights, lost ones too, in the units shown."""
        rows = {"place, rms [m]": self.place_rms}
        rows |= {f"{name}, largest [{unit}]": factor * self.values[name] for name, (unit, factor) in SHOWN.items()}
        return {name: _percentiles(values, self.percentiles) for name, values in rows.items()}

    def to_document(self) -> dict[str, object]:
        """The summary as what becomes JSON; angles in degrees where their names say so."""
        limits = asdict(self.limits)
        return {
            "flights": self.flights,
            "lost": self.lost,
            "lost_by": self.lost_by,
            "limits": {name: {"value": limits[name] * factor, "unit": unit} for name, (unit, factor) in SHOWN.items()},
            "percentiles": list(self.percentiles),
            "figures": self.figures,
            "worst": {
                "number": self.worst,
                "lost_after": float(self.lost_after[self.worst]),
                **{name: float(self.values[name][self.worst]) * factor for name, (_, factor) in SHOWN.items()},
            },
        }

    def __repr__(self) -> str:
        limits, counts, figures = asdict(self.limits), self.lost_by, self.figures
        head = ("", *(f"{p:g} %" for p in self.percentiles), "limit", "beyond")
        rows = [("place, rms [m]", *(f"{v:.4g}" for v in figures["place, rms [m]"]), "", "")]
        for name, (unit, factor) in SHOWN.items():
            label = f"{name}, largest [{unit}]"
            bound = f"{limits[name] * factor:.4g}" if math.isfinite(limits[name]) else "none"
            rows.append((label, *(f"{v:.4g}" for v in figures[label]), bound, str(counts[name])))
        when = self.lost_after[self.worst]
        after = f", lost after {when:.2f} s" if math.isfinite(when) else ""
        head_line = f"{self.flights} flights, {self.lost} lost; worst is number {self.worst}{after}"
        return f"{head_line}\n{text_table(head, rows)}"


def spread(batch: Batch, trim: Trim, *, limits: Limits | None = None) -> Spread:
    """Summary of flights that should have held the place and heading of a trim.

    Args:
        batch: from `simulate_closed_loops`; what happens between its samples is not seen.
        trim: where they started.
        limits: beyond which one is lost; `Limits()` where not given.
    """
    bounds, start = limits or Limits(), trim.states()
    x, y, z, psi, phi, theta = (batch[name] - start[name] for name in ("x", "y", "z", "psi", "phi", "theta"))
    level = np.hypot(x, y)
    series: dict[str, Array] = {
        "lean": _lean(phi + start["phi"], theta + start["theta"], start["phi"], start["theta"]),
        "rate": np.sqrt(batch["p"] ** 2 + batch["q"] ** 2 + batch["r"] ** 2),
        "place": level,
        "height": np.abs(z),
        "heading": np.abs(psi),
    }
    series = {name: np.where(np.isfinite(values), values, np.inf) for name, values in series.items()}
    finite = np.all([np.isfinite(values) for values in series.values()], axis=0)
    series = {name: np.where(finite, values, np.inf) for name, values in series.items()}  # diverged in all at once
    largest = {name: np.max(values, axis=0) for name, values in series.items()}
    beyond: NDArray[np.bool_] = ~finite
    excess = np.zeros(level.shape[1])
    for name, bound in asdict(bounds).items():
        beyond = beyond | (series[name] > bound)
        excess = np.maximum(excess, largest[name] / bound if math.isfinite(bound) else 0.0)
    lost = np.any(beyond, axis=0) | ~np.all(finite, axis=0)
    after = np.where(lost, batch.time[np.argmax(beyond, axis=0)], np.inf)
    with np.errstate(invalid="ignore", over="ignore"):
        rms = np.sqrt(np.mean(np.where(finite, level, np.inf) ** 2, axis=0))
    far = np.hypot(largest["place"], largest["height"]) if not np.any(lost) else np.where(lost, excess, -np.inf)
    # Of those that diverged, which are all infinitely far, the first to be lost.
    worst = int(np.lexsort((after, -far))[0])
    return Spread(bounds, largest, rms, after, worst)


def _lean(phi: Array, theta: Array, phi_0: float, theta_0: float) -> Array:
    """Angle between two directions of gravity in body axes, those of the attitudes [rad]."""

    def down(phi: Any, theta: Any) -> tuple[Any, Any, Any]:
        return -np.sin(theta), np.cos(theta) * np.sin(phi), np.cos(theta) * np.cos(phi)

    a, b = down(phi, theta), down(phi_0, theta_0)
    along = sum(p * q for p, q in zip(a, b, strict=True))
    cross = np.sqrt(
        (a[1] * b[2] - a[2] * b[1]) ** 2 + (a[2] * b[0] - a[0] * b[2]) ** 2 + (a[0] * b[1] - a[1] * b[0]) ** 2
    )
    return np.asarray(np.arctan2(cross, along), dtype=np.float64)


def _percentiles(values: Array, percents: tuple[float, ...]) -> tuple[float, ...]:
    quantiles = np.percentile(np.minimum(values, _HUGE), percents)
    return tuple(float("inf") if v > 1e-6 * _HUGE else float(v) for v in quantiles)
