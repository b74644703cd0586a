"""A card's derivatives held against published ones, and the assumptions of theirs that bring it nearer."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from swashplate.errors import SwashError, TrimError
from swashplate.models.catalogue import from_card
from swashplate.models.conventional.derivative_table import DerivativeTable, split_name, unit
from swashplate.models.published import read_published
from swashplate.models.vehicle import Vehicle
from swashplate.physics.environment import Environment
from swashplate.shown import Saved
from swashplate.simulation.derivatives import derivative_table
from swashplate.simulation.trim import Trim, trim
from swashplate.text_table import text_table

_SMALL = 0.02
"""Share of the largest of its kind below which a published derivative's relative difference says nothing."""
_WORTH = 0.003
"""Least fall of the mean difference for which an assumption is named."""
_SWITCHES: tuple[tuple[str, tuple[Any, ...], bool], ...] = (
    ("in_plane", ("blade-element", "thrust-tilt"), True),
    ("inflow", ("glauert", "uniform"), True),
    ("yaw_at_blades", (True, False), False),
    ("yaw_at_hub", (True, False), False),
    ("precession_torque", (True, False), False),
)
"""Option, its values, and whether the trim of a straight flight changes with it."""
_ZEROS = (
    ("wake_distortion", False),
    ("rotor_drag_thrust", True),
    ("fin_wake", True),
    ("tailplane_wake", True),
    ("fuselage_wake", True),
)
"""Number that reports leave out, and whether the trim changes with it."""


@dataclass(frozen=True)
class Assumption:
    """One thing that a report may assume, in the words of the command line."""

    words: str
    option: tuple[str, Any] | None = None
    zero: str | None = None
    new_trim: bool = False
    mixes: bool = False  # the other kind of roll and yaw rows


@dataclass(frozen=True)
class ComparisonStep:
    """An assumption taken on, after those before it, and the table that it gives."""

    words: str
    table: DerivativeTable
    mean: float
    near: int


@dataclass(frozen=True, repr=False)
class PublishedComparison(Saved):
    """Published derivatives against a card's.

    Attributes:
        published: by name, SI.
        scale: what a difference is divided by: the published value, or 2 % of the largest of its kind.
        steps: the card as it is, and with one assumption after another that brings it nearer.
    """

    published: Mapping[str, float]
    scale: Mapping[str, float]
    steps: tuple[ComparisonStep, ...]

    def differences(self, table: DerivativeTable) -> dict[str, float]:
        """By name; 0.1 is 10 % too much, -2 the same size with the wrong sign."""
        return {
            name: (-1.0 if value < 0.0 else 1.0) * (table[name] - value) / self.scale[name]
            for name, value in self.published.items()
        }

    def rows(self) -> tuple[list[str], list[list[str]]]:
        """Heading and cells of a table for the screen: published, the card's, with the assumptions, and by whom."""
        first, last = self.steps[0].table, self.steps[-1].table
        before, after = self.differences(first), self.differences(last)
        more = len(self.steps) > 1
        head = ["derivative", "unit", "published", "card", "off", *(["nearest", "off"] if more else []), *last.parts]
        rows = []
        for name, value in self.published.items():
            row, column = split_name(name)
            small = abs(value) < self.scale[name]
            cells = [name, unit(name), f"{value:.4g}", f"{first[name]:.4g}", _off(before[name], small)]
            if more:
                cells += [f"{last[name]:.4g}", _off(after[name], small)]
            parts = [f"{part[row, column]:.3g}" if part[row, column] else "-" for part in last.parts.values()]
            rows.append([*cells, *parts])
        return [heading.replace("_", " ") for heading in head], rows

    def step_rows(self) -> tuple[list[str], list[list[str]]]:
        """Heading and cells of the mean difference with one assumption after another."""
        steps = [
            [s.words or "the card", f"{100 * s.mean:.1f} %", f"{s.near} of {len(self.published)}"] for s in self.steps
        ]
        return ["with, one after another", "mean", "within 10 %"], steps

    def to_document(self) -> dict[str, object]:
        """Numbers and words as JSON types."""
        off = [self.differences(step.table) for step in self.steps]
        values = {
            name: {
                "published": value,
                "unit": unit(name),
                "small": abs(value) < self.scale[name],
                "values": [step.table[name] for step in self.steps],
                "off": [each[name] for each in off],
            }
            for name, value in self.published.items()
        }
        steps = [{"with": s.words, "mean": s.mean, "within 10 %": s.near} for s in self.steps]
        return {"steps": steps, "derivatives": values}

    def __repr__(self) -> str:
        differences, steps = (text_table(head, rows, left=(0, 1)) for head, rows in (self.rows(), self.step_rows()))
        small = "small: below 2 % of the largest of its kind"
        return f"{small}\n{differences}\n\nMean difference (each at most 100 %)\n{steps}"


def _off(difference: float, small: bool) -> str:
    return "small" if small else f"{100 * difference:+.0f} %"


def compare_derivatives(vehicle: Vehicle, at: Trim, path: str | Path, *, primed: bool = False) -> PublishedComparison:
    """A card's derivatives beside a report's, and what the report may assume (see `hold_against`).

    Args:
        vehicle: a single-rotor helicopter.
        at: its trim, in straight flight.
        path: the report's numbers: `name,value[,unit]`, or A and B as a matrix (see `read_published`).
        primed: its roll and yaw rows are mixed by the product of inertia.

    Raises:
        SwashError: for a file that cannot be read, a flight that turns, or a vehicle without a single rotor.
    """
    if at.turn:
        raise SwashError("takes straight flight.", channel="--published", hint="Leave out the turn.")
    sense = getattr(vehicle.options, "sense", 1.0)
    flight = {name: at.states().get(name, 0.0) for name in ("u", "v", "w")}
    return hold_against(vehicle, at, read_published(path, sense=sense, flight=flight), primed=primed)


def hold_against(
    vehicle: Vehicle, at: Trim, published: Mapping[str, float], *, primed: bool = False
) -> PublishedComparison:
    """A card's derivatives against published derivatives, and which assumptions bring it nearer, best first.

    An assumption is taken on while it lowers the mean difference (each at most 100 %) by 0.3 points. It explains a
    table and is no fit: no number of the card is changed but those that a report leaves out (set to zero).

    Args:
        vehicle: a single-rotor helicopter.
        at: its trim, in straight flight.
        published: by the names of `DerivativeTable`, SI.
        primed: the published roll and yaw rows are taken to be mixed by the product of inertia.

    Raises:
        SwashError: for a vehicle that is no single-rotor helicopter.
    """
    scale = _scale(published)
    comparison = PublishedComparison(published, scale, ())

    def step(words: str, flown: Vehicle, where: Trim, mixed: bool) -> ComparisonStep:
        table = derivative_table(flown, where)
        if mixed:
            card = flown.card.values()
            table = table.primed(**{name: card[name] for name in ("inertia_xx", "inertia_zz", "inertia_xz")})
        off = np.abs(list(comparison.differences(table).values()))
        return ComparisonStep(words, table, float(np.mean(np.minimum(off, 1.0))), int(np.sum(off <= 0.1)))

    here = (vehicle, at, primed)
    steps, left = [step("", *here)], list(_assumptions(vehicle, primed))
    while left:
        tried = []
        for assumption in left:
            flown = _with(here[0], assumption)
            try:
                where = _again(flown, here[1]) if assumption.new_trim else here[1]
            except TrimError:  # it cannot fly with this one: no explanation
                continue
            there = (flown, where, here[2] != assumption.mixes)
            tried.append((step(assumption.words, *there), there, assumption))
        if not tried:
            break
        best, there, taken = min(tried, key=lambda each: each[0].mean)
        if best.mean > steps[-1].mean - _WORTH:
            break
        steps.append(best)
        here = there
        left.remove(taken)
    return replace(comparison, steps=tuple(steps))


def _scale(published: Mapping[str, float]) -> dict[str, float]:
    """Absolute published values, at least a share of the largest among forces or moments by speed, rate or control."""
    kinds: dict[tuple[bool, int], float] = {}
    kind = {name: (split_name(name)[0] < 3, min(split_name(name)[1] // 3, 2)) for name in published}
    for name, value in published.items():
        kinds[kind[name]] = max(kinds.get(kind[name], 0.0), abs(value))
    return {name: max(abs(value), _SMALL * kinds[kind[name]], 1e-12) for name, value in published.items()}


def _assumptions(vehicle: Vehicle, primed: bool) -> Iterable[Assumption]:
    options, card = vehicle.options, vehicle.card.values()
    if card.get("inertia_xz"):
        yield Assumption("without --primed" if primed else "--primed", mixes=True)
    for name, values, new_trim in _SWITCHES:
        for value in values:
            if getattr(options, name, value) != value:
                switch = f"--set {name}={str(value).lower()}"
                yield Assumption(switch, option=(name, value), new_trim=new_trim)
    for name, new_trim in _ZEROS:
        if card.get(name):
            yield Assumption(f"--set {name}=0", zero=name, new_trim=new_trim)


def _with(vehicle: Vehicle, assumption: Assumption) -> Vehicle:
    card = vehicle.card
    if assumption.option is not None:
        name, value = assumption.option
        card = replace(card, options={**card.options, name: value})
    if assumption.zero is not None:
        card = card.with_values({assumption.zero: 0.0}, source="left out, as reports do", status="assumed")
    return from_card(card)


def _again(vehicle: Vehicle, before: Trim) -> Trim:
    around: Environment = before.environment
    return trim(vehicle, speed=before.speed, lateral=before.lateral, climb=before.climb, environment=around)
