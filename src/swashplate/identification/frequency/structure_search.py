"""A search for the structure: composed ones grow part by part, the hopeless are dropped after a first look.

Parts are added to the best one so far while the misfit falls by more than their numbers would make it fall by chance
(an information criterion; Tischler and Remple 2012, ch. 13, reduce from above, which costs a fit of everything).
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace

from swashplate.errors import IdentificationError
from swashplate.identification.frequency.fitted_pairs import PairChoice
from swashplate.identification.frequency.foreseen_parts import Foresight, worths
from swashplate.identification.frequency.linear_start import from_core, from_relative
from swashplate.identification.frequency.response_cost import ACCEPTABLE
from swashplate.identification.frequency.search_candidates import (
    contains,
    cores,
    exchanges,
    joining,
    named,
    offered,
    preferred,
    ranks,
    without,
)
from swashplate.identification.frequency.search_result import Contender, StructureSearch, reasons
from swashplate.identification.frequency.state_space_fit import fit_targets, silent
from swashplate.identification.frequency.state_space_search import led, price_of
from swashplate.identification.frequency.structure_score import parts_in, spread_of, squared_misfit
from swashplate.identification.responses.frequency_response import FrequencyResponse
from swashplate.models.linear.composition import PREFIX, in_order
from swashplate.models.linear.state_space import StateSpaceModel
from swashplate.models.linear.state_space_file import structure
from swashplate.models.linear.structure_parts import PARTS

LOOK, FOLLOW = 12, 40
"""Iterations of a first look, and of one that is followed."""

HOPELESS = 3.0
"""Times the least misfit of its round from which a structure is abandoned."""

FOLLOWED = 3
"""Of what is foreseen to be worth its numbers, how much is fitted."""

ROUNDS = 12
"""Times that parts are added at most."""

ALIKE = 1.02
"""Times the J_ave of a structure up to which one that contains it may end (what may not be exceeded counts too)."""

LEVEL = 2.0
"""Points of the criterion that are no difference."""

DOUBTFUL = 30.0
"""Points by which slopes call a part worth its numbers, below which a fit without it is tried on the way."""

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
    regressed: dict[str, StateSpaceModel | None] = field(default_factory=dict)

    def composed(self, parts: Iterable[str]) -> StateSpaceModel:
        """The structure of these parts, prepared."""
        return self.prepare(structure(PREFIX + "+".join(in_order(parts))))

    def looks(
        self, models: Sequence[StateSpaceModel], *, like: Sequence[Contender] = (), iterations: int = FOLLOW
    ) -> list[Contender]:
        """A fit of each that can answer to what was measured."""
        contenders = []
        for one in models:
            try:
                contenders.append(self.look(one, like=like, iterations=iterations))
            except IdentificationError as error:
                self.refused[one.name] = error
        return contenders

    def look(self, model: StateSpaceModel, *, like: Sequence[Contender], iterations: int) -> Contender:
        """A fit of a model from the best start: where relatives have ended, or what the responses say of its core."""
        known = self.tried.get(model.name)
        targets, ceilings, left_out = self.choice.targets(model, self.responses)
        every = (*targets, *ceilings)
        like = [*like, *(one for one in self.tried.values() if _inside(model, one))]
        starts = {one.name: _begun(model, one.fit.solution) for one in like}
        if known is not None:
            end = price_of(known.fit.solution, every)
            ahead = [one for one in starts.values() if ALIKE * price_of(one, every) < end]
            if not ahead and (known.fit.converged or len(known.fit.history) > iterations):
                return known
            starts["itself"] = known.fit.solution
        if known is None and all(one.cost > ACCEPTABLE for one in like):
            by_core = from_core(model, self.responses, band=self.choice.band, regressed=self.regressed)
            starts |= {name: led(one, every) for name, one in {"": model, **by_core}.items()}
        self.say(model.name)
        fit = fit_targets(
            model,
            targets,
            others=starts,
            ceilings=ceilings,
            left_out=left_out,
            starts=1,
            iterations=iterations,
            advise=False,
            data=self.responses.data,
            settings={"sources": list(self.responses.sources), "method": self.responses.method}
            | self.choice.settings(),
        )
        contender = Contender(model.name, fit, squared_misfit(fit.solution, targets))
        self.tried[model.name] = contender
        return contender

    def followed(self, best: Contender, others: Iterable[Sequence[str]]) -> Contender:
        """The best of a structure and of others that are begun where it has ended; the best of them to its end."""
        fits = self.looks([self.composed(parts) for parts in others], like=[best], iterations=LOOK)
        first = self.best([best, *fits])
        return best if first is best else self.best([best, self.look(first.fit.start, like=(), iterations=FOLLOW)])

    def answering(self, parts: Sequence[str]) -> list[str]:
        """Parts with the derivatives without which a seen response would be nothing at all."""
        model = self.composed(parts)
        targets, *_ = self.choice.targets(model, self.responses)
        return [*parts, *joining(parts, silent(model, targets))]

    def score(self, one: Contender, best: Contender) -> float:
        """The information criterion, with the scatter that the best one so far leaves."""
        return one.score(_spread(best), _points(best))

    def best(self, among: Sequence[Contender]) -> Contender:
        """The one of the least score; of those that are level, the one whose parts come first."""
        least = min(among, key=lambda one: one.misfit)
        lowest = min(self.score(one, least) for one in among)
        level = [one for one in among if self.score(one, least) <= lowest + LEVEL]
        return min(level, key=lambda one: (one.parameters, ranks(one.parts)))

    def round(self, models: Sequence[StateSpaceModel]) -> list[Contender]:
        """A first look at each; those that are not hopeless are followed."""
        fits = self.looks(models, iterations=LOOK)
        if not fits:
            raise next(iter(self.refused.values()))
        self.audit()
        fits = [self.tried[one.name] for one in fits]
        least = min(one.misfit for one in fits)
        for one in fits:
            if one.misfit > HOPELESS * least:
                self.tried[one.name] = replace(one, abandoned=True)
        return [self.look(one.fit.start, like=(), iterations=FOLLOW) for one in fits if one.misfit <= HOPELESS * least]

    def audit(self) -> None:
        """Fits that end above what they contain are tried again from there, and called failed where that is in vain."""
        for one in sorted(self.tried.values(), key=lambda c: len(c.parts)):
            for other in tuple(self.tried.values()):
                if _ends_above(one, other):
                    again = self.look(one.fit.start, like=[other], iterations=FOLLOW)
                    failed = other.name if _ends_above(again, other) else ""
                    one = self.tried[one.name] = replace(again, failed=failed)


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
        ended = search.round(prepared)
        search.audit()
        best = search.best([search.tried[one.name] for one in ended])
    else:
        best, leaner = _grown(search)
    pick, notes = _judged(search, best, judge)
    pick = _finished(search, pick, pick.fit.start if structures else search.composed(pick.parts))
    tried = sorted(search.tried.values(), key=lambda one: (one is not pick, one.abandoned, search.score(one, pick)))
    refused = [f"  not fitted: {error.problem}" for error in search.refused.values()]
    if apart:
        notes = [f"Compared on what all of them answer to, without {', '.join(apart)}.", *notes]
    reasoning = [*reasons(pick, [c for c in tried if c is not pick], leaner), *refused, *notes]
    return StructureSearch(tuple(tried), pick, tuple(reasoning), time.perf_counter() - began)


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
    apart = tuple(dict.fromkeys(name for names in pairs for name in names if name not in everywhere))
    if not everywhere:
        raise IdentificationError(
            f"the structures {', '.join(one.name for one in structures)} answer to no response in common.",
            hint="Compare structures of the same inputs and outputs.",
        )
    return (replace(choice, without=(*choice.without, *apart)) if apart else choice), apart


def _points(one: Contender) -> int:
    return sum(t.omega.size for t in one.fit.targets)


def _spread(one: Contender) -> float:
    return spread_of(one.misfit, _points(one), one.parameters)


def _inside(model: StateSpaceModel, other: Contender) -> bool:
    """Whether a composed structure contains one that was tried, with every number that was free there."""
    both = "composed" in model.document and "composed" in other.fit.start.document
    return both and contains(parts_in(model), other.parts) and set(other.fit.names) <= set(model.free)


def _ends_above(one: Contender, other: Contender) -> bool:
    """Whether a fit ends above that of a structure which it contains."""
    return one.cost > ALIKE * other.cost and _inside(one.fit.start, other)


def _begun(model: StateSpaceModel, relative: StateSpaceModel) -> StateSpaceModel:
    """The model from where a relative has ended."""
    if "composed" in model.document and "composed" in relative.document:
        return from_relative(model, relative)
    return model.with_values({n: p.value for n, p in relative.parameters.items() if n in model.free})


def _grown(search: _Search) -> tuple[Contender, dict[str, Contender]]:
    """The best composed structure, and what it would be without each of its parts."""
    begun = [search.answering(parts) for parts in cores(search.responses)]
    best = search.best(search.round([search.composed(parts) for parts in begun]))
    leaner: dict[str, Contender] = {}
    for _ in range(ROUNDS):
        ways = (_extended, _trimmed, _exchanged)
        following = next((one for way in ways if (one := way(search, best)) is not best), best)
        if following is best:
            leaner = {
                part: one
                for part, kept in without(best.parts).items()
                for one in search.looks([search.composed(kept)], like=[best], iterations=LOOK)
            }
            following = search.best([best, *leaner.values()])
            if following is best:
                break
        best = following
    search.audit()
    return search.tried[best.name], {part: search.tried[one.name] for part, one in leaner.items()}


def _extended(search: _Search, best: Contender) -> Contender:
    """The best of the structure and those with more that is foreseen to be worth its numbers."""
    foresight = Foresight(best.fit.solution, best.fit.targets, offered=offered(search.responses), spread=_spread(best))
    # Slopes say little of what is far off.
    followed = foresight.proposals()[: None if best.cost > ACCEPTABLE else FOLLOWED]
    return search.followed(best, [named([*best.parts, *preferred(one.parts)]) for one in followed])


def _trimmed(search: _Search, best: Contender) -> Contender:
    """The best of the structure and those without what slopes call idle."""
    worth = worths(best.fit.solution, best.fit.targets, spread=_spread(best))
    smaller = [kept for part, kept in without(best.parts).items() if worth.get(part, DOUBTFUL) < DOUBTFUL]
    idle = [name for name in worth if name not in PARTS and worth[name] < 0.0]
    taken = [[min(idle, key=lambda name: worth[name])], idle] if len(idle) > 1 else [idle] if idle else []
    smaller += [[part for part in best.parts if part not in out] for out in taken]
    return search.followed(best, smaller)


def _exchanged(search: _Search, best: Contender) -> Contender:
    """The best of the structure and those with one part in place of another that it may stand for."""
    return search.followed(best, exchanges(best.parts, search.responses))


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
    first = search.tried[best.name]
    ahead = min(near, key=lambda c: c.held_out)
    if ahead.name != first.name and ahead.held_out < BETTER * first.held_out:
        text = f"The hold-out prefers it to {first.name}: J_rms {ahead.held_out:.2f} against {first.held_out:.2f}."
        return ahead, [text]
    if len(near) == 1:
        return first, [f"The hold-out was flown with it alone: J_rms {first.held_out:.2f}; no other comes as near."]
    return first, [f"The hold-out agrees: J_rms {first.held_out:.2f}, the next {min(_others(near, first)):.2f}."]


def _others(near: Sequence[Contender], pick: Contender) -> list[float]:
    return [c.held_out for c in near if c.name != pick.name]


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
