"""Nested structures: the model that was asked for, with and without each part of its physics."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from swashplate.errors import IdentificationError
from swashplate.flights.flight import Flight
from swashplate.identification.core.nested import EffectTest, holm, tested
from swashplate.identification.core.parameters import Free, Parameterization, parameterize
from swashplate.identification.core.result import Result
from swashplate.identification.identify import identify
from swashplate.models.choices import PhysicalEffect
from swashplate.models.vehicle import Vehicle

Told = Callable[[str, int, int], None]
"""Told which fit begins, how many are done and how many there are."""


@dataclass(frozen=True)
class NestedFits:
    """The fit that was asked for, and one more for every effect.

    Attributes:
        fit: what was asked for.
        others: by effect's name: the fit without it where the fit has it, with it where the fit has not; an effect that
            leaves no trace in the flights is missing.
        tests: one per effect.
    """

    fit: Result[Any, Any]
    others: Mapping[str, Result[Any, Any]]
    tests: tuple[EffectTest, ...]

    def pair(self, test: EffectTest) -> tuple[Result[Any, Any], Result[Any, Any]]:
        """The fits without and with an effect."""
        other = self.others[test.effect.name]
        return (other, self.fit) if test.asked else (self.fit, other)


def fit_nested(
    vehicle: Vehicle,
    flights: Flight | Sequence[Flight],
    *,
    free: str | Sequence[str | Free] = "full",
    effects: Sequence[PhysicalEffect] | None = None,
    ties: Sequence[str] = (),
    fixed: Mapping[str, float] | None = None,
    priors: Mapping[str, tuple[float, float]] | None = None,
    method: str | None = None,
    outputs: Sequence[str] | None = None,
    iterations: int = 120,
    told: Told | None = None,
) -> NestedFits:
    """Fit a structure, and it again with and without each effect.

    Args:
        vehicle, flights, free, ties, fixed, priors, method, outputs, iterations: as of `identify`. What an effect
            adds has no prior.
        effects: to try; the model's own (`Traits.effects`) where None.
        told: told which fit begins.

    Raises:
        IdentificationError: without effects, or where no fit can be started.
    """
    tried = tuple(vehicle.traits.effects(vehicle.card) if effects is None else effects)
    if not tried:
        raise IdentificationError(
            f"'{vehicle.name}' names no effects that nested structures could differ by.",
            channel="nested",
            hint="Give effects=[...] in Python, or `effects` in the model's traits.",
        )
    table = parameterize(vehicle, free, ties=ties, fixed=fixed, priors=priors)
    how: dict[str, Any] = {"method": method, "outputs": outputs, "iterations": iterations}
    say = told or (lambda words, done, total: None)
    say("the structure that was asked for", 0, len(tried) + 1)
    base = _fitted(table, {}, (), flights, how)
    others, tests = {}, []
    for number, effect in enumerate(tried):
        asked = [name for name in effect.without if name in table.names]
        held = _held(table, effect)
        if held:
            tests.append(EffectTest(effect, bool(asked), refused=f"{held}; free it, or fix it at what leaves it out."))
            continue
        say(f"{'without' if asked else 'with'} {effect.name}", number + 1, len(tried) + 1)
        dropped = {n: v for n, v in effect.without.items() if n in asked}
        added = () if asked else tuple(effect.without)
        try:
            other = _fitted(_from(table, base), dropped, added, flights, how)
        except IdentificationError as error:
            tests.append(EffectTest(effect, bool(asked), refused=str(error)))
            continue
        others[effect.name] = other
        narrow, wide = (other, base) if asked else (base, other)
        tests.append(tested(effect, narrow, wide, asked=bool(asked)))
    return NestedFits(base, others, holm(tests))


def _held(table: Parameterization, effect: PhysicalEffect) -> str:
    """What keeps an effect in the structure that was asked for without being free, in words; "" for nothing.

    A number that is held at another value than the one that leaves the effect out, or tied, makes no nested pair.
    """
    tied, card = dict(table.ties), table.vehicle.card.values()
    apart = [n for n, v in effect.without.items() if n not in table.names and n not in tied and card[n] != v]
    words = [f"{name} is tied to {tied[name].text}" for name in effect.without if name in tied]
    return ", ".join([*words, *(f"{name} is held at {card[name]:g}" for name in apart)])


def _from(table: Parameterization, fit: Result[Any, Any]) -> Parameterization:
    """The same freedom, begun where a fit ended: nested fits then differ by the structure and not by the search."""
    return replace(
        table, free=tuple(replace(f, start=fit[f.name].value) if f.name in fit.names else f for f in table.free)
    )


def _fitted(
    table: Parameterization,
    dropped: Mapping[str, float],
    added: Sequence[str],
    flights: Flight | Sequence[Flight],
    how: Mapping[str, Any],
) -> Result[Any, Any]:
    kept: list[str | Free] = [*(f for f in table.free if f.name not in dropped), *table.of_records, *table.noises]
    tied = [f"{name} = {expression.text}" for name, expression in table.ties if name not in added]
    vehicle = table.vehicle.with_values(dict(dropped))
    return identify(vehicle, flights, free=[*kept, *added], ties=tied, **how)
