"""`TrimCurve`: steady flight over a range of speeds, as one result."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

from swashplate.errors import SwashError, TrimError
from swashplate.models.doubts import doubts, shaft_power
from swashplate.models.vehicle import Vehicle
from swashplate.public import resolve
from swashplate.shown import Shown
from swashplate.simulation.trim import Trim, trim


def trims_over_speed(vehicle: Vehicle, speeds: Sequence[float], **course: Any) -> tuple[Trim, ...]:
    """Trims at ascending speeds [m/s], each from the one before; `course` as of `trim`.

    Raises:
        TrimError: at the first speed that cannot be flown, with the limit that stops it.
    """
    trims: list[Trim] = []
    for speed in speeds:
        at = partial(trim, vehicle, speed=float(speed), **course)
        try:
            trims.append(at(near=trims[-1] if trims else None))
        except TrimError:
            # A neighbour may lead astray where the trim curve bends; what fails afresh too, fails.
            trims.append(at())
    return tuple(trims)


ENGINE = "engine_power"
_IDLE = 1e-3
"""Share of the engine's power that counts as none."""


@dataclass(frozen=True, repr=False)
class TrimCurve(Shown):
    """The trims of a vehicle at ascending speeds.

    Attributes:
        vehicle: whose they are.
        trims: at each speed.
    """

    vehicle: Vehicle
    trims: tuple[Trim, ...]

    def page(self, *, title: str | None = None) -> Any:
        """The page of `sp.report`, under a heading, its own where None."""
        return resolve("compose_speeds")(self, title=title)

    @property
    def remarks(self) -> tuple[str, ...]:
        """Where the vehicle's equations do not hold, and where the power is none that its engine gives."""
        return tuple(
            f"At {at.speed:g} m/s {doubt}."
            for at in self.trims
            for doubt in (*doubts(self.vehicle, at.state, at.inputs, at.environment), *self._power_verdict(at))
        )

    def _power_verdict(self, at: Trim) -> tuple[str, ...]:
        """What of the shaft power a pilot must know: more than the engine has, or less than none."""
        power, engine = self.power(at), self.vehicle.card.values().get(ENGINE)
        if power is None:
            return ()
        if power < -_IDLE * (engine or abs(power)):
            return (
                f"the air drives the rotors with {-power:.0f} W: autorotation. Without a rotor that may turn faster no "
                "engine holds this",
            )
        if engine is not None and ENGINE in self.vehicle.parameter_names and power > engine:
            return (f"the rotors need {power:.0f} W, and {ENGINE} on the card is {engine:.0f} W: not to be held",)
        return ()

    def units(self) -> dict[str, str]:
        """The unit of every input and state."""
        v = self.vehicle
        return dict(zip((*v.input_names, *v.state_names), (*v.input_units, *v.state_units), strict=True))

    def power(self, at: Trim) -> float | None:
        """Shaft power [W]; None where the vehicle has none."""
        return shaft_power(self.vehicle, at.state, at.inputs, at.environment)

    def shown_unit(self, name: str) -> str:
        """The unit that an input or a state is shown in: angles in degrees."""
        unit = self.units()[name]
        return "deg" if unit == "rad" else unit

    def shown(self, name: str) -> list[float]:
        """An input or a state at each speed, in the unit that it is shown in."""
        values = [{**at.states(), **at.commands()}[name] for at in self.trims]
        return [math.degrees(value) for value in values] if self.shown_unit(name) == "deg" else values

    def columns(self) -> dict[str, list[float]]:
        """Speed, inputs, attitude, flapping and power by "name [unit]", one value a speed."""
        first = self.trims[0]
        names = (*self.vehicle.input_names, *(n for n in ("phi", "theta", "a1", "b1") if n in first.state_names))
        columns = {"speed [m/s]": [at.speed for at in self.trims]}
        if any(at.climb != first.climb for at in self.trims):
            columns["climb [m/s]"] = [at.climb for at in self.trims]
        columns |= {f"{name} [{self.shown_unit(name)}]": self.shown(name) for name in names}
        powers = [self.power(at) for at in self.trims]
        if all(power is not None for power in powers):
            columns["power [W]"] = [float(power or 0.0) for power in powers]
        return columns

    def to_document(self) -> dict[str, object]:
        """Trims, units and remarks as JSON types."""
        return {
            "trims": [
                {
                    "speed": at.speed,
                    "climb": at.climb,
                    "lateral": at.lateral,
                    "turn": at.turn,
                    "air_density": float(at.environment.air_density),
                    "inputs": at.commands(),
                    "states": at.states(),
                    "residual": at.residual,
                    **({} if (power := self.power(at)) is None else {"power": power}),
                }
                for at in self.trims
            ],
            "units": self.units(),
            "remarks": self.remarks,
        }

    def __repr__(self) -> str:
        columns = self.columns()
        width = max(map(len, columns)) + 2
        lines = ["".join(f"{head:>{width}}" for head in columns)]
        lines += ["".join(f"{value:>{width}.3f}" for value in row) for row in zip(*columns.values(), strict=True)]
        return "\n".join([f"Trims of {self.vehicle.card.title}", *lines, *(f"! {remark}" for remark in self.remarks)])


def trim_curve(vehicle: Vehicle, speeds: Sequence[float], **course: Any) -> TrimCurve:
    """Steady flight over a range of speeds.

    Args:
        vehicle: what flies.
        speeds: ahead, ascending [m/s].
        course: the rest of it, and what is around, as of `trim`.

    Raises:
        SwashError: without any speed.
        TrimError: at the first speed that cannot be flown, with the limit that stops it.
    """
    if not len(speeds):
        raise SwashError("a trim curve needs at least one speed.", channel="speeds")
    return TrimCurve(vehicle, trims_over_speed(vehicle, speeds, **course))
