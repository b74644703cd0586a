"""What the next flight must have, from how the last ones were predicted.

A model's error some time ahead is nearly the same on every flight of an aircraft; fit % is one minus that error over
how far the flight moved. So a flight that moves little shows nothing, however good the model is.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from swashplate.documents import read
from swashplate.errors import SwashError
from swashplate.flights.schema import channel as known
from swashplate.shown import Saved
from swashplate.text_table import text_table
from swashplate.validation.validation import Validation

if TYPE_CHECKING:
    from swashplate.api.verbs.maneuver import NeedManeuver

_HINT = "Give the validation.json that `swash identify --hold-out` or `swash validate` writes."
_UNJUDGED = "cannot be judged"


@dataclass(frozen=True)
class Movement:
    """What one channel must move for a wanted fit.

    Attributes:
        channel: schema name. error, moved, needed: rms of the model's error, of the flight's movement over the horizon,
            and of what it must be [the channel's inside unit].
    """

    channel: str
    error: float
    moved: float
    needed: float


@dataclass(frozen=True, repr=False)
class NeededExcitation(Saved):
    """What the next flight must have.

    Attributes:
        fit: wanted [%]. horizon: seconds ahead. movements: by channel. further: what else, in words.
    """

    fit: float
    horizon: float
    movements: tuple[Movement, ...]
    further: tuple[str, ...]

    def rows(self) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
        """Heading and cells of a table."""
        cells: list[tuple[str, ...]] = []
        for one in self.movements:
            unit = known(one.channel)
            numbers = (f"{value * unit.shown_factor:.3g}" for value in (one.error, one.moved, one.needed))
            cells.append((one.channel, unit.shown_unit, *numbers, "yes" if one.moved >= one.needed else "NO"))
        return ("channel", "unit", "error, rms", "moved, rms", "needed, rms", "enough"), cells

    def to_document(self) -> dict[str, object]:
        """All of it as what becomes JSON."""
        return {
            "fit": self.fit,
            "horizon": self.horizon,
            "movements": [vars(one) for one in self.movements],
            "further": list(self.further),
        }

    def __repr__(self) -> str:
        head = f"For a fit of {self.fit:g} % {self.horizon:g} s ahead with errors as they are:"
        return "\n".join([head, text_table(*self.rows(), left=(0, 1)), *self.further])


@dataclass(frozen=True)
class _Floor:
    channel: str
    horizon: float
    rms: float
    moved: float


@dataclass(frozen=True)
class _Axis:
    axis: str
    level: str


@dataclass(frozen=True)
class _Document:
    floors: tuple[_Floor, ...]
    verdict: tuple[_Axis, ...]
    not_logged: tuple[str, ...] = ()


def needed_for(asked: NeedManeuver) -> NeededExcitation:
    """What was asked of a validation."""
    validation, fit, horizon = asked.validation, asked.fit, asked.ahead
    if not 0.0 < fit < 100.0:
        raise SwashError(f"is {fit:g} %, expected more than 0 and less than 100.", channel="fit")
    told: Validation | _Document = (
        validation
        if isinstance(validation, Validation)
        else read(validation, form="json", kind="validation", schema=_Document, hint=_HINT)
    )
    there = sorted({floor.horizon for floor in told.floors if math.isfinite(floor.horizon)})
    if not any(abs(horizon - one) < 1e-9 for one in there):
        has = ", ".join(f"{one:g}" for one in there) or "no horizon"
        raise SwashError(f"is {horizon:g} s, and the validation has {has}.", channel="ahead", hint=_HINT)
    left = 1.0 - fit / 100.0
    movements = tuple(
        Movement(floor.channel, floor.rms, floor.moved, floor.rms / left)
        for floor in told.floors
        if abs(floor.horizon - horizon) < 1e-9 and floor.channel not in ("x", "y", "z")
    )
    answered = [one.axis for one in told.verdict if one.level == _UNJUDGED]
    further = [
        f"{axis}: an independent multisine or sweep on top of the loop; its command only answered the motion."
        for axis in answered
    ]
    if told.not_logged:
        further.append(f"Log {', '.join(told.not_logged)}: they were guessed from the commands.")
    return NeededExcitation(fit, horizon, movements, tuple(further))
