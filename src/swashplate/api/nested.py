"""The verb `identify_nested`: which parts of a model's physics flights ask for, and what leaving one out would move."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, ClassVar

from swashplate import atomic
from swashplate.api.report_folder import ReportFolder
from swashplate.api.saying import Say, silent
from swashplate.flights.flight import Flight, as_flights
from swashplate.flights.overlap import check_disjoint
from swashplate.identification.core.nested import LEVEL, EffectTest
from swashplate.identification.core.parameters import Free
from swashplate.identification.nested import NestedFits, fit_nested
from swashplate.models.choices import PhysicalEffect
from swashplate.models.vehicle import Vehicle
from swashplate.reporting.structure import Cell, Points, Report, Section, Table
from swashplate.reporting.versions import date, versions
from swashplate.validation.held_out import AHEAD, Gain, as_document, gains, prediction_errors


@dataclass(frozen=True, repr=False)
class NestedComparison(ReportFolder):
    """A structure with and without each part of its physics.

    Attributes:
        fits: what was fitted, and the tests.
        held_out: by effect's name, how much better the fit with it predicts flights that no fit has seen; empty without
            such flights.
    """

    files: ClassVar[tuple[str, ...]] = ("report.html", "nested.json", "fit.json")

    fits: NestedFits
    held_out: Mapping[str, Sequence[Gain]] = field(default_factory=dict)

    @property
    def tests(self) -> tuple[EffectTest, ...]:
        """One per effect."""
        return self.fits.tests

    def words(self, test: EffectTest) -> str:
        """One effect in a line: likelihood, what it moves, and whether unseen flights agree."""
        unseen_gains = self.held_out.get(test.effect.name, ())
        told = [f"{one.channel} {one.points:+.1f} points ({one.verdict})" for one in unseen_gains if one.verdict]
        judged = any(math.isfinite(one.low) for one in unseen_gains)
        largest = max(unseen_gains, key=lambda one: abs(one.points), default=None)
        if judged or largest is None:
            silent_about = f"no channel's prediction differs for sure {AHEAD:g} s ahead"
        else:
            silent_about = f"{largest.channel} {largest.points:+.1f} points at most, in flights too short to judge it"
        unseen = f"; held out: {', '.join(told) or silent_about}" if unseen_gains else ""
        return test.words + unseen

    def lines(self) -> list[str]:
        """Missing physics first, then the rest."""
        missing = [one for one in self.tests if one.verdict == "needed" and not one.asked]
        names = ", ".join(one.effect.name for one in missing)
        head = f"Missing physics: {names}." if missing else "No missing physics among what was tried."
        order = sorted(self.tests, key=lambda one: (one not in missing, one.adjusted))
        return [head, *(self.words(one) for one in order)]

    def to_document(self) -> dict[str, Any]:
        """Numbers and words as JSON types, without time histories."""
        return {
            "kind": "nested structures",
            "fit": self.fits.fit.to_document(comparisons=False),
            "tests": [one.to_document() for one in self.tests],
            "held_out": as_document(self.held_out),
        }

    def write(self, folder: Path) -> None:
        super().write(folder)
        atomic.write_json(folder / "nested.json", self.to_document())
        self.fits.fit.save(folder / "fit.json")

    def page(self, *, title: str | None = None) -> Report:
        """What `sp.report` writes."""
        head, *rest = self.lines()
        named = self.fits.fit.model.card.called
        return Report(
            title=title or f"Nested structures of '{named}'",
            banners=(),
            summary=(("Physics", head, "caution" if head.startswith("Missing") else "good"),),
            picture=None,
            sections=(Section("effects", "With and without", (self._table(), Points(tuple(rest)))),),
            made=f"swashplate {versions()['swashplate']}, {date()}",
        )

    def _table(self) -> Table:
        tones = {"needed": "good", "not needed": "plain", "cannot be told": "quiet"}
        rows = []
        for one in self.tests:
            largest = next(iter(one.moved.items()), None)
            rows.append(
                (
                    Cell(one.effect.name),
                    Cell("asked for" if one.asked else "added"),
                    Cell("" if one.refused else f"{one.gain:+.1f}", number=True),
                    Cell("" if one.refused else f"{one.scale:.2g}", number=True),
                    Cell("" if one.refused else f"{one.adjusted:.1g}", number=True),
                    Cell(one.verdict, tone=tones[one.verdict]),
                    Cell("" if largest is None else f"{largest[0]} by {largest[1]:+.1f} sigma"),
                )
            )
        return Table(
            "What each part of the physics adds",
            ("effect", "was", "log-likelihood", "colour", "p", "verdict", "moves most"),
            tuple(rows),
            note=f"p: chance of such a gain where the effect is not there, for all tests together; needed below "
            f"{LEVEL:g}. Colour: by how much coloured residuals exaggerate twice the gain. Sigmas are those of the fit "
            "without the effect.",
        )

    def __repr__(self) -> str:
        return "\n".join(self.lines())


def identify_nested(
    vehicle: Vehicle,
    flights: Flight | Iterable[Flight],
    *,
    hold_out: Flight | Iterable[Flight] = (),
    free: str | Sequence[str | Free] = "full",
    effects: Sequence[PhysicalEffect] | None = None,
    method: str | None = None,
    outputs: Sequence[str] | None = None,
    ties: Sequence[str] = (),
    fixed: Mapping[str, float] | None = None,
    priors: Mapping[str, tuple[float, float]] | None = None,
    iterations: int = 120,
    names: Sequence[str] | None = None,
    say: Say = silent,
) -> NestedComparison:
    """Identify a vehicle with and without each part of its physics, and judge which parts the flights ask for.

    Each effect of the model (`Traits.effects`) that is free is held at the values that leave it out, and each that is
    not is freed. Likelihoods are compared by a test that allows for coloured residuals, for values on a bound and for
    the number of tests (`identification.core.nested`); predictions of held-out flights by blocks drawn alike.

    Args:
        vehicle: the equations and the numbers to start from.
        flights: conditioned.
        hold_out: conditioned flights that no fit sees, with their pose tracked.
        effects: to try; the model's own where None.
        free, method, outputs, ties, fixed, priors, iterations: as of `identify`.
        names: what the user calls the flights and the hold-outs, for messages.
        say: told what is being done.

    Raises:
        FlightError: where a hold-out is a stretch that the fits see, or a flight lacks a channel.
        IdentificationError: without effects, or where no fit can be started.
    """
    seen = as_flights(flights)
    unseen = as_flights(hold_out)
    check_disjoint([*seen, *unseen], names)
    fits = fit_nested(
        vehicle,
        seen,
        free=free,
        effects=effects,
        ties=ties,
        fixed=fixed,
        priors=priors,
        told=lambda words, done, total: say(f"fitting {words}", done=done, total=total),
        method=method,
        outputs=outputs,
        iterations=iterations,
    )
    if not unseen:
        return NestedComparison(fits)
    say("predicting what no fit has seen")
    base = prediction_errors(fits.fit, unseen)
    held = {}
    for test in fits.tests:
        if not test.refused:
            other = prediction_errors(fits.others[test.effect.name], unseen)
            held[test.effect.name] = gains(other, base) if test.asked else gains(base, other)
    return NestedComparison(fits, held)
