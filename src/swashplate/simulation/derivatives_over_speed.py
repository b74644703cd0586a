"""`Derivatives`: stability and control derivatives at one trim or over speed, with bounds where the card has sigmas."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from swashplate.errors import SwashError
from swashplate.models.conventional.derivative_table import DerivativeTable, factor_to_feet, split_name, unit
from swashplate.models.vehicle import Vehicle
from swashplate.public import resolve
from swashplate.shown import Shown
from swashplate.simulation.derivatives import CardSpread, derivative_table, spread
from swashplate.simulation.trim import Trim

if TYPE_CHECKING:
    pass

_NOTHING = 1e-9
"""Smaller derivatives are not shown."""


@dataclass(frozen=True, repr=False)
class Derivatives(Shown):
    """Derivatives of force per mass and moment per inertia, by contributor; flapping follows without delay.

    Attributes:
        vehicle: a single-rotor helicopter.
        trims: where. tables: the derivatives there, SI.
        imperial: shown in feet.
        bounds: 5 % and 95 % bounds at the one trim, from the card's sigmas and the model's error; None where not asked.
    """

    vehicle: Vehicle
    trims: tuple[Trim, ...]
    tables: tuple[DerivativeTable, ...]
    imperial: bool = False
    bounds: CardSpread | None = None

    def page(self, *, title: str | None = None) -> Any:
        """The page of `sp.report`, under a heading, its own where None."""
        return resolve("compose_speeds")(self, title=title)

    def factor(self, name: str) -> float:
        """From SI to the unit that a derivative is shown in."""
        return factor_to_feet(*split_name(name)) if self.imperial else 1.0

    def unit(self, name: str) -> str:
        """The unit that a derivative is shown in."""
        return unit(name, imperial=self.imperial)

    def parts(self, table: DerivativeTable, name: str) -> dict[str, float]:
        """What each contributor adds to a derivative, in the unit that it is shown in."""
        row, column = split_name(name)
        return {part: float(block[row, column]) * self.factor(name) for part, block in table.parts.items()}

    def rows(self, table: DerivativeTable) -> tuple[list[str], list[list[str]]]:
        """Heading and cells of a table for the screen; derivatives that are nothing are left out."""
        head = ["derivative", "unit", "total", *(part.replace("_", " ") for part in table.parts)]
        head += ["5 %", "95 %", "5 % by card", "95 %"] if self.bounds is not None else []
        rows = []
        for name in table.names():
            factor = self.factor(name)
            if abs(total := table[name] * factor) < _NOTHING:
                continue
            row = [name, self.unit(name), f"{total:.4g}"]
            row += [f"{v:.3g}" if abs(v) > _NOTHING else "-" for v in self.parts(table, name).values()]
            if self.bounds is not None:
                both = (*self.bounds.derivatives[name][1:], *self.bounds.by_card[name])
                row += [f"{bound * factor:.4g}" for bound in both]
            rows.append(row)
        return head, rows

    def to_document(self) -> dict[str, object]:
        """Values, units, contributions and bounds as JSON types."""
        return {"tables": [self._table(at, table) for at, table in zip(self.trims, self.tables, strict=True)]}

    def _table(self, at: Trim, table: DerivativeTable) -> dict[str, Any]:
        document: dict[str, Any] = {"speed": at.speed}
        wide = self.bounds
        if wide is not None:
            document |= {"modes": wide.modes(), "draws": wide.draws, "refused": wide.refused, "words": wide.words}
        entries = {}
        for name in table.names():
            entries[name] = {
                "value": table[name] * self.factor(name),
                "unit": self.unit(name),
                "by": self.parts(table, name),
            }
            if wide is not None:
                factor, error = self.factor(name), wide.model[name]
                (low, high), (card_low, card_high) = wide.derivatives[name][1:], wide.by_card[name]
                entries[name] |= {"5 %": low * factor, "95 %": high * factor}
                entries[name] |= {"5 % by card": card_low * factor, "95 % by card": card_high * factor}
                entries[name] |= {"model error": error.sigma, "model error of": error.kind}
        return {**document, "derivatives": entries}

    def __repr__(self) -> str:
        lines = [f"Derivatives of {self.vehicle.card.title}"]
        for at, table in zip(self.trims, self.tables, strict=True):
            head, rows = self.rows(table)
            widths = [max(len(row[i]) for row in (head, *rows)) + 2 for i in range(len(head))]
            lines.append(f"At {at.speed:g} m/s")
            lines += ["".join(f"{c:>{w}}" for c, w in zip(row, widths, strict=True)) for row in (head, *rows)]
        lines += [self.bounds.words] if self.bounds is not None else []
        return "\n".join(lines)


def derivatives(
    vehicle: Vehicle,
    trims: Trim | Sequence[Trim],
    *,
    primed: bool = False,
    imperial: bool = False,
    uncertainty: bool = False,
    draws: int = 200,
    seed: int = 0,
) -> Derivatives:
    """Stability and control derivatives of a single-rotor helicopter, split by what contributes to them.

    Args:
        vehicle: with a single-rotor card.
        trims: one, or several over speed (`sp.trim`, `sp.trim_curve(...).trims`).
        primed: roll and yaw rows mixed by the product of inertia, as most published tables are.
        imperial: shown in feet, as Bhandari et al. (2005) have them.
        uncertainty: also 5 % and 95 % bounds from the sigmas on the card and what such a model misses, at the one trim.
        draws: samples of the card for that. seed: of the samples.

    Raises:
        SwashError: for another kind of vehicle, or bounds over several trims or of primed derivatives.
    """
    at = (trims,) if isinstance(trims, Trim) else tuple(trims)
    if uncertainty and len(at) > 1:
        raise SwashError("takes one speed.", channel="--uncertainty", hint="Give --speed a single number.")
    if uncertainty and primed:
        raise SwashError("has no bounds.", channel="--primed", hint="Leave out --uncertainty or --primed.")
    tables = [derivative_table(vehicle, each) for each in at]
    if primed:
        card = vehicle.card.values()
        tables = [t.primed(**{name: card[name] for name in ("inertia_xx", "inertia_zz", "inertia_xz")}) for t in tables]
    bounds = spread(vehicle, at[0], draws=draws, seed=seed) if uncertainty else None
    return Derivatives(vehicle, at, tuple(tables), imperial, bounds)
