"""A search for the structure: composed ones grow part by part, the hopeless are dropped after a first look.

Parts are added to the best one so far while the misfit falls by more than their numbers would make it fall by chance
(an information criterion; Tischler and Remple 2012, ch. 13, reduce from above, which costs a fit of everything).
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from swashplate.errors import IdentificationError
from swashplate.identification.frequency.composed_start import from_core
from swashplate.identification.frequency.fitted_pairs import PairChoice
from swashplate.identification.frequency.lacking_parts import parts_in
from swashplate.identification.frequency.search_candidates import additions, cores, exchanges, without
from swashplate.identification.frequency.search_result import Contender, StructureSearch, squared_misfit
from swashplate.identification.frequency.search_words import reasons
from swashplate.identification.frequency.state_space_fit import fit_targets
from swashplate.identification.frequency.structure_misfit import misfits
from swashplate.identification.responses.frequency_response import FrequencyResponse
from swashplate.models.linear.composition import PREFIX
from swashplate.models.linear.state_space import StateSpaceModel
from swashplate.models.linear.state_space_file import structure
from swashplate.models.linear.structure_parts import PARTS

LOOK, FOLLOW = 12, 40
"""Iterations of a first look, and of one that is followed."""

HOPELESS = 3.0
"""Times the least misfit of its round from which a structure is abandoned."""

ROUNDS = 3
"""Times that parts are added."""

LEVEL = 2.0
"""Points of the criterion that are no difference."""

CLOSE, BETTER = 10.0, 0.9
"""Points of the criterion within which held-out records decide, and the share of J_rms that one has to come down to."""


@dataclass
class _Search:
    """The responses, and what was tried on them."""

    responses: FrequencyResponse
    choice: PairChoice
    prepare: Callable[[StateSpaceModel], StateSpaceModel]
    say: Callable[[str], None]
    seed: int
    tried: dict[str, Contender] = field(default_factory=dict)
    refused: dict[str, IdentificationError] = field(default_factory=dict)

    def looks(self, models: Sequence[StateSpaceModel], *, like: Contender | None, iterations: int) -> list[Contender]:
        """A fit of each that can answer to what was measured."""
        contenders = []
        for one in models:
            try:
                contenders.append(self.look(one, like=like, iterations=iterations))
            except IdentificationError as error:
                self.refused[one.name] = error
        return contenders

    def look(self, model: StateSpaceModel, *, like: Contender | None, iterations: int) -> Contender:
        """A fit of a model from the better of its own start and what a relative of it has found."""
        known = self.tried.get(model.name)
        if known is not None and len(known.fit.history) > iterations:
            return known
        self.say(model.name)
        targets, ceilings, left_out = self.choice.targets(model, self.responses)
        others: dict[str, StateSpaceModel] = {}
        for name, one in (("a relative", like), ("itself", known)):
            if one is not None:
                values = {p.name: p.value for p in one.fit.estimates if p.name in model.free}
                others[name] = model.with_values(values)
        if like is None and known is None:
            others = from_core(model, self.responses, band=self.choice.band)
        fit = fit_targets(
            model,
            targets,
            others=others,
            ceilings=ceilings,
            left_out=left_out,
            starts=1,
            iterations=iterations,
            data=self.responses.data,
            settings={"sources": list(self.responses.sources), "method": self.responses.method}
            | self.choice.settings(),
        )
        contender = Contender(model.name, fit, squared_misfit(fit.solution, targets))
        self.tried[model.name] = contender
        return contender

    def score(self, one: Contender, best: Contender) -> float:
        """The information criterion, with the scatter that the best one so far leaves."""
        points = sum(t.omega.size for t in best.fit.targets)
        spread = max(1.0, best.misfit / max(2.0 * points - best.parameters, 1.0))
        return one.score(spread, points)

    def best(self, among: Sequence[Contender]) -> Contender:
        """The one of the least score; of those that are level, the one whose parts come first."""
        least = min(among, key=lambda one: one.misfit)
        lowest = min(self.score(one, least) for one in among)
        level = [one for one in among if self.score(one, least) <= lowest + LEVEL]
        return min(level, key=lambda one: (one.parameters, [tuple(PARTS).index(p) for p in parts_in(one.fit.solution)]))

    def round(self, models: Sequence[StateSpaceModel], *, like: Contender | None = None) -> list[Contender]:
        """A first look at each; those that are not hopeless are followed."""
        seen = self.looks(models, like=like, iterations=LOOK)
        if not seen:
            raise next(iter(self.refused.values()))
        least = min(one.misfit for one in seen)
        for one in seen:
            if one.misfit > HOPELESS * least:
                self.tried[one.name] = replace(one, abandoned=True)
        return [
            self.look(one.fit.start, like=None, iterations=FOLLOW) for one in seen if one.misfit <= HOPELESS * least
        ]


def search_structures(
    responses: FrequencyResponse,
    *,
    structures: Sequence[StateSpaceModel] = (),
    choice: PairChoice | None = None,
    prepare: Callable[[StateSpaceModel], StateSpaceModel] | None = None,
    judge: Callable[[StateSpaceModel], float] | None = None,
    seed: int = 0,
    say: Callable[[str], None] | None = None,
) -> StructureSearch:
    """Structures fitted to the same responses, and the one that is worth its parameters.

    Args:
        responses: from `respond`, with the channels of the structures.
        structures: those to compare; none for composed ones that the channels allow.
        choice: pairs and bands.
        prepare: what is done to each structure before its fit (trim, held values).
        judge: J_rms of a model on records that no fit has seen.
        seed: of the starting points of the pick.
        say: told which structure is being tried.

    Raises:
        IdentificationError: no channels that a structure could have, nothing coherent.
    """
    began = time.perf_counter()
    search = _Search(responses, choice or PairChoice(), prepare or (lambda m: m), say or (lambda _: None), seed)
    leaner: dict[str, Contender] = {}
    apart: tuple[str, ...] = ()
    if structures:
        prepared = [search.prepare(one) for one in _by_name(structures)]
        search.choice, apart = _in_common(search.choice, prepared, responses)
        best = search.best(search.round(prepared))
    else:
        best, leaner = _grown(search)
    pick, words = _judged(search, best, judge)
    pick = _finished(search, pick, pick.fit.start if structures else _composed(search, pick.name.split("+")))
    tried = sorted(search.tried.values(), key=lambda one: (one is not pick, one.abandoned, search.score(one, pick)))
    refused = [f"  not fitted: {error.problem}" for error in search.refused.values()]
    if apart:
        words = [f"Compared on what all of them answer to, without {', '.join(apart)}.", *words]
    told = [*reasons(pick, [c for c in tried if c is not pick], leaner), *refused, *words]
    return StructureSearch(tuple(tried), pick, tuple(told), time.perf_counter() - began)


def _by_name(structures: Sequence[StateSpaceModel]) -> list[StateSpaceModel]:
    """The structures, with a number behind names that several have."""
    names = [one.name for one in structures]
    return [
        replace(one, name=f"{one.name} #{names[:k].count(one.name) + 1}") if names.count(one.name) > 1 else one
        for k, one in enumerate(structures)
    ]


def _in_common(
    choice: PairChoice, structures: Sequence[StateSpaceModel], responses: FrequencyResponse
) -> tuple[PairChoice, tuple[str, ...]]:
    """The choice without the pairs that only some structures have, and these: misfits of different pairs are no rivals.

    Raises:
        IdentificationError: where the structures have no pair in common.
    """
    pairs = [[f"{t.output}/{t.input}" for t in choice.targets(one, responses)[0]] for one in structures]
    everywhere = set.intersection(*map(set, pairs))
    apart = tuple(dict.fromkeys(name for own in pairs for name in own if name not in everywhere))
    if not everywhere:
        raise IdentificationError(
            f"the structures {', '.join(one.name for one in structures)} answer to no response in common.",
            hint="Compare structures of the same inputs and outputs.",
        )
    return (replace(choice, without=(*choice.without, *apart)) if apart else choice), apart


def _composed(search: _Search, parts: Sequence[str]) -> StateSpaceModel:
    return search.prepare(structure(PREFIX + "+".join(parts)))


def _grown(search: _Search) -> tuple[Contender, dict[str, Contender]]:
    """The best composed structure, and what it would be without each of its parts."""
    begun = cores(search.responses)
    best = search.best(search.round([_composed(search, parts) for parts in begun]))
    idle: set[str] = set()
    for _ in range(ROUNDS):
        parts = tuple(best.name.split("+"))
        missed = bool(misfits(best.fit.solution, best.fit.targets))
        better: list[str] = []
        for group in additions(parts, search.responses, every=missed):
            named = {"+".join(p for p in PARTS if p in (*parts, n)): n for n in group if n not in idle}
            seen = search.looks([_composed(search, name.split("+")) for name in named], like=best, iterations=LOOK)
            looks = {named[one.name]: one for one in seen}
            idle |= {n for n, one in looks.items() if not _hopeful(one, best)}
            first = search.best([best, *looks.values()])
            better += [n for n, one in looks.items() if one is first]
        if not better:
            break
        several = [[n] for n in better] if len(better) < 2 else [better, *([n] for n in better)]
        grown = search.looks([_composed(search, [*parts, *more]) for more in several], like=best, iterations=FOLLOW)
        following = search.best([best, *grown])
        if following is best:
            break
        best = following
    return _settled(search, best)


def _hopeful(one: Contender, best: Contender) -> bool:
    """Whether a part lowers the misfit by half of what its numbers cost, were the scatter as it should be."""
    points = sum(t.omega.size for t in best.fit.targets)
    half = 0.5 * (one.score(np.inf, points) - best.score(np.inf, points))
    return best.score(1.0, points) - one.score(1.0, points) > -half


def _settled(search: _Search, best: Contender) -> tuple[Contender, dict[str, Contender]]:
    """The structure with parts exchanged and taken out where that is better, and what those that stay are worth."""
    while True:
        parts = best.name.split("+")
        leaner = {
            part: one
            for part, kept in without(parts).items()
            for one in search.looks([_composed(search, kept)], like=best, iterations=FOLLOW)
        }
        others = [_composed(search, other) for other in exchanges(parts, search.responses)]
        exchanged = search.looks(others, like=best, iterations=FOLLOW)
        following = search.best([best, *leaner.values(), *exchanged])
        if following is best:
            return best, leaner
        best = following


def _judged(
    search: _Search, best: Contender, judge: Callable[[StateSpaceModel], float] | None
) -> tuple[Contender, list[str]]:
    """The pick of those that the responses hardly tell apart, by records that no fit has seen."""
    if judge is None:
        return best, []
    near = [c for c in search.tried.values() if not c.abandoned]
    near = sorted(near, key=lambda c: search.score(c, best))
    near = [c for c in near if search.score(c, best) <= search.score(best, best) + CLOSE][:4]
    for one in near:
        search.say(f"{one.name} along the hold-out")
        search.tried[one.name] = replace(one, held_out=judge(one.fit.solution))
    near = [search.tried[one.name] for one in near]
    own = search.tried[best.name]
    ahead = min(near, key=lambda c: c.held_out)
    if ahead.name != own.name and ahead.held_out < BETTER * own.held_out:
        text = f"The hold-out prefers it to {own.name}: J_rms {ahead.held_out:.2f} against {own.held_out:.2f}."
        return ahead, [text]
    if len(near) == 1:
        return own, [f"The hold-out was flown with it alone: J_rms {own.held_out:.2f}; no other comes as near."]
    return own, [f"The hold-out agrees: J_rms {own.held_out:.2f}, the next {min(_others(near, own)):.2f}."]


def _others(near: Sequence[Contender], own: Contender) -> list[float]:
    return [c.held_out for c in near if c.name != own.name]


def _finished(search: _Search, pick: Contender, model: StateSpaceModel) -> Contender:
    """The pick with a fit of its model from several starts, where that is better."""
    search.say(f"{pick.name} to its end")
    targets, ceilings, left_out = search.choice.targets(model, search.responses)
    fit = fit_targets(
        model, targets, others={"the search": model.with_values({n: pick.fit[n].value for n in model.free})},
        ceilings=ceilings, left_out=left_out, starts=2, seed=search.seed, data=search.responses.data,
        settings={**pick.fit.settings, "started_from": "search"},
    )  # fmt: skip
    done = replace(pick, fit=fit, misfit=squared_misfit(fit.solution, targets)) if fit.cost <= pick.cost else pick
    search.tried[pick.name] = done
    return done
