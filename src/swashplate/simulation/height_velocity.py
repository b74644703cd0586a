"""The height-velocity diagram: heights and speeds from which an engine's failure ends in a landing."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from swashplate.arrays import Array
from swashplate.errors import SwashError
from swashplate.models.surroundings import environment_of
from swashplate.models.vehicle import Vehicle
from swashplate.physics.environment import Environment
from swashplate.public import resolve
from swashplate.shown import Shown
from swashplate.simulation.engine_failure import (
    FASTEST,
    FULL_SIZE,
    LOADING,
    Autorotating,
    landed,
    least_power_speed,
    point_mass,
    steady,
)

_DROP = 8 * 0.0254
"""m: drop that landing gear must take (14 CFR 29.725 (a))."""
_DROP_SHARE = 0.2
"""Of the radius: what small helicopters' gear is taken to take; assumed."""
_RUN = 15.0
"""m/s: largest speed ahead at touch-down at `FULL_SIZE`; assumed."""
_TILT = math.radians(15.0)
"""Largest tilt at touch-down; assumed."""
_HEIGHTS, _SPEEDS = 24, 11
_LOWEST, _TALLEST, _FASTEST = 0.3, 24.0, 1.6
"""Heights in radii and in hover's v^2 / g; fastest speed over that of least power."""
_RECOVERIES, _FLARES, _PULLS = (0.0, 2.0, 6.0), (0.0, 2.0, 4.0, 6.0, 9.0), (0.05, 0.15, 0.4)
"""What the pilots do, see `Autorotating`; flares in seconds at `FULL_SIZE`."""


@dataclass(frozen=True, repr=False)
class HeightVelocity(Shown):
    """Where a failed engine can be survived, by the best of a family of landings.

    Attributes:
        vehicle: what flies.
        speeds: level, at the failure [m/s], shape (m,).
        heights: of the skids above the ground [m], shape (n,).
        margin: below zero where the landing is within all limits: the largest of sink, speed ahead and tilt at
            touch-down over its limit, less one, shape (n, m).
        delay: s after the failure before the pilot acts.
        sink, run: limits at touch-down [m/s].
        tried: ways to land that were tried from each point.
    """

    vehicle: Vehicle
    speeds: Array
    heights: Array
    margin: Array
    delay: float
    sink: float
    run: float
    tried: int

    def page(self, *, title: str | None = None) -> Any:
        """The page of `sp.report`, under a heading, its own where None."""
        return resolve("compose_height_velocity")(self, title=title)

    @property
    def safe(self) -> NDArray[np.bool_]:
        """Whether a landing from there is within the limits, shape (n, m)."""
        return self.margin <= 0.0

    @property
    def hover_to_avoid(self) -> tuple[tuple[float, float], ...]:
        """Heights [m] between which a hover ends in no landing, ascending; an end may be that of the diagram."""
        margin, h = self.margin[:, 0], np.log(self.heights)
        beyond = np.concatenate([[False], margin > 0.0, [False]])
        firsts, afters = np.flatnonzero(~beyond[:-1] & beyond[1:]), np.flatnonzero(beyond[:-1] & ~beyond[1:])

        def edge(out: int, within: int) -> float:
            if not (0 <= within < h.size and np.isfinite(margin[out])):
                return float(self.heights[out])
            share = margin[out] / (margin[out] - margin[within])
            return float(np.exp(h[out] + share * (h[within] - h[out])))

        return tuple(
            (edge(first, first - 1), edge(after - 1, after))
            for first, after in zip(firsts.tolist(), afters.tolist(), strict=True)
        )

    @property
    def low_hover(self) -> float:
        """Height [m] up to which every hover ends in a landing; 0 where none does."""
        return self._crossing(self.margin[:, 0], rising=True)

    @property
    def high_hover(self) -> float:
        """Height [m] from which every hover does; NaN where none of these heights is enough."""
        return self._crossing(self.margin[:, 0], rising=False)

    @property
    def knee(self) -> float:
        """Speed [m/s] from which the region about the hover is left behind at all heights above the low hover's; NaN
        where it is not left."""
        above = self.heights >= max(self.low_hover, 2.0 * self.vehicle.card.values()["rotor_radius"])
        clear = self.safe[above].all(axis=0)
        return float(self.speeds[np.argmax(clear)]) if clear.any() else math.nan

    @property
    def avoided(self) -> float:
        """Share of the diagram (speed, and logarithm of height) from which no landing is within the limits."""
        return float(1.0 - self.safe.mean())

    def _crossing(self, margin: Array, *, rising: bool) -> float:
        safe, h = margin <= 0.0, np.log(self.heights)
        if safe.all():
            return float(self.heights[-1] if rising else self.heights[0])
        i = int(np.argmax(~safe)) if rising else len(safe) - 1 - int(np.argmax(~safe[::-1]))
        inside, outside = (i - 1, i) if rising else (i + 1, i)
        if not 0 <= inside < len(safe):
            return 0.0 if rising else math.nan
        share = margin[outside] / (margin[outside] - margin[inside])
        return float(np.exp(h[outside] + share * (h[inside] - h[outside])))

    @property
    def assumptions(self) -> tuple[str, ...]:
        """What the diagram stands on, a sentence each."""
        return (
            f"The engine stops at once and the pilot does nothing for {self.delay:g} s (civil tests: 1 s on the upper "
            "boundary and none on the lower; military: 2 s everywhere).",
            f"After that {self.tried} ways to land are tried from each point, and the best counts: speed sought (0, "
            "the present one, that of least power), thrust given up for rotor speed, when flare and pull begin. A "
            "pilot who does worse needs more height.",
            f"A landing touches down with at most {self.sink:.2g} m/s of sink, {self.run:.2g} m/s ahead and "
            f"{math.degrees(_TILT):.0f} deg of tilt.",
            f"Mass point in the vertical plane; blades lift up to C_T / sigma = {LOADING}; rotor speed is held below "
            f"{100.0 * FASTEST:.0f} %. No ground effect, no tail rotor's power, no wind; tilt changes by at most 0.5 "
            f"rad/s at a rotor radius of {FULL_SIZE:g} m, faster on smaller ones by Froude's scale.",
        )

    def as_dict(self) -> dict[str, Any]:
        """Numbers as JSON types."""
        return {
            "speeds": self.speeds.tolist(),
            "heights": self.heights.tolist(),
            "margin": self.margin.tolist(),
            "hover_to_avoid": self.hover_to_avoid,
            "low_hover": self.low_hover,
            "high_hover": self.high_hover,
            "knee": self.knee,
            "avoided": self.avoided,
            "assumptions": self.assumptions,
        }

    def __repr__(self) -> str:
        def told(value: float, unit: str) -> str:
            return f"{value:.3g} {unit}" if math.isfinite(value) else "not within the diagram"

        return "\n".join(
            (
                f"Height-velocity diagram of {self.vehicle.card.title}",
                f"hover to avoid: {', '.join(f'{a:.2g} to {b:.3g} m' for a, b in self.hover_to_avoid) or 'none'}",
                f"speed from which all heights are safe: {told(self.knee, 'm/s')}",
                *(f"* {words}" for words in self.assumptions),
            )
        )


def height_velocity(
    vehicle: Vehicle,
    *,
    delay: float = 1.0,
    sink: float | None = None,
    run: float | None = None,
    speeds: Sequence[float] | None = None,
    heights: Sequence[float] | None = None,
    environment: Environment | None = None,
) -> HeightVelocity:
    """Heights and speeds from which a helicopter lands after its engine has failed: a simulation of many landings.

    Args:
        vehicle: a single-rotor helicopter.
        delay: after the failure before the pilot acts [s].
        sink: largest sink at touch-down [m/s]; None: that of a drop from 8 in (14 CFR 29.725), or from a fifth of the
            rotor's radius where that is less.
        run: largest speed ahead at touch-down [m/s]; None: 15 m/s at a radius of 8 m, by Froude's scale.
        speeds, heights: of the diagram, ascending [m/s, m]; None: up to 1.6 times the speed of least power, and
            from 0.3 rotor radii to where hover's induced velocity leads in some seconds.
        environment: air and gravity; wind is left out.

    Raises:
        SwashError: for another kind of vehicle, a model whose rotor speed nothing turns, or an impossible number.
    """
    if not vehicle.traits.rotorcraft:
        raise SwashError(
            "has no height-velocity diagram: it is made for single-rotor helicopters.", where=vehicle.card.where
        )
    for name, value, least in (("delay", delay, 0.0), ("sink", sink, 1e-6), ("run", run, 0.0)):
        if value is not None and not least <= value <= 60.0:
            raise SwashError(f"is {value:g}, expected {least:.0f} to 60.", channel=name)
    p = point_mass(vehicle, environment_of(vehicle, environment))
    sink = math.sqrt(2.0 * p.gravity * min(_DROP, _DROP_SHARE * p.radius)) if sink is None else sink
    run = _RUN * p.pace if run is None else run
    cruise = least_power_speed(p)
    tallest = _TALLEST * p.hover**2 / p.gravity + 2.0 * p.hover * delay
    v = _ascending("speeds", speeds, np.linspace(0.0, _FASTEST * cruise, _SPEEDS), least=0.0)
    h = _ascending("heights", heights, np.geomspace(_LOWEST * p.radius, tallest, _HEIGHTS), least=1e-3)
    ways = ((0.0, 1.0, 2.0), _RECOVERIES, tuple(p.pace * t for t in _FLARES), _PULLS)
    H, V, T, *rest = (axis.ravel() for axis in np.meshgrid(h, v, *ways, indexing="ij"))
    target = np.choose(T.astype(int), (np.zeros_like(V), V, np.full_like(V, cruise)))
    ends = landed(p, steady(p, V, H), Autorotating(target, *rest), delay)
    worst = np.maximum.reduce([ends.sink / sink, np.abs(ends.ahead) / max(run, 1e-9), np.abs(ends.tilt) / _TILT])
    worst = np.where(ends.height > 0.0, np.inf, worst)
    margin = worst.reshape(h.size, v.size, -1).min(axis=2) - 1.0
    return HeightVelocity(vehicle, v, h, margin, delay, sink, run, math.prod(map(len, ways)))


def _ascending(name: str, given: Sequence[float] | None, usual: Array, *, least: float) -> Array:
    if given is None:
        return usual
    values = np.asarray(given, dtype=np.float64)
    if values.size < 2 or values[0] < least or not (np.diff(values) > 0.0).all() or not np.isfinite(values).all():
        raise SwashError(f"are {list(given)!r:.60}, expected two or more, ascending from {least:g} on.", channel=name)
    return values
