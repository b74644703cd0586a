"""Which form of a transfer function the responses ask for: the usual ones are tried, the vague ones not suggested."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from swashplate.identification.core.result import Estimate, percent
from swashplate.identification.frequency.response_cost import Target
from swashplate.identification.frequency.transfer_function_fit import (
    TransferFunctionFit,
    as_told,
    fit_form,
    targets_of,
)
from swashplate.identification.responses.frequency_response import FrequencyResponse
from swashplate.models.linear.transfer_function import USUAL, Form

UNTOLD = 100.0
"""Standard deviation in percent above which a parameter speaks against its form."""


@dataclass(frozen=True)
class TriedStructure:
    """One structure that was tried: its form, number of parameters, mean J and the fit; why it is not suggested."""

    form: Form
    parameters: int
    cost: float
    fit: TransferFunctionFit
    unsound: str = ""


def suggest(
    responses: FrequencyResponse,
    *,
    input: str,
    outputs: Sequence[str] | None = None,
    band: tuple[float, float] | None = None,
    forms: Sequence[Form] = USUAL,
    least_coherence: float = 0.6,
    seed: int = 0,
    tell: Callable[[int, int], None] | None = None,
) -> tuple[TriedStructure, tuple[TriedStructure, ...]]:
    """The usual structures tried, and the one with the fewest parameters that costs hardly more than the best.

    What has parameters on their bounds, standard deviations above 100 %, or a growing mode beyond the band, is not
    suggested while anything else is there; a delay that is zero is left out instead. Hardly: J within 10 of, or within
    1.5 times, the least J of these (the pair of Tischler and Remple's "acceptable" and "indistinguishable" lies a
    factor of two apart). `tell` hears how many structures of how many are done.

    Returns:
        The suggestion, and all trials by number of parameters.
    """
    wanted = targets_of(responses, input=input, outputs=outputs, band=band, least=least_coherence)
    trials = []
    for k, form in enumerate(forms):
        if tell is not None:
            tell(k, len(forms))
        trial = _tried(wanted, form, responses, seed=seed)
        delays = {name for name in trial.fit.names if name.split(" ")[0] == "tau"}
        vague = {p.name for p in _vague(trial.fit)}
        if vague and vague <= delays:
            trial = _tried(wanted, replace(form, delay=False), responses, seed=seed)
        trials.append(trial)
    trials.sort(key=lambda trial: (trial.parameters, trial.cost))
    sound = [trial for trial in trials if not trial.unsound] or trials
    least = min(trial.cost for trial in sound)
    best = next(trial for trial in sound if trial.cost <= max(1.5 * least, least + 10.0))
    if best.unsound:
        words = f"no form that was tried has all its parameters told; of this one, {best.unsound}."
        best = replace(best, fit=replace(best.fit, warnings=(*best.fit.warnings, words)))
    return best, tuple(trials)


def _tried(wanted: Sequence[Target], form: Form, responses: FrequencyResponse, *, seed: int) -> TriedStructure:
    fit = as_told(fit_form(wanted, form, fixed={}, seed=seed), responses)
    against = [*map(_vague_words, _vague(fit)), *_beyond(fit)]
    return TriedStructure(form, len(fit.estimates), fit.cost, fit, "; ".join(against))


def _beyond(fit: TransferFunctionFit) -> list[str]:
    """Growing modes that are faster than all that was fitted: they shape what is slower, and were never seen."""
    top = max(float(t.omega[-1]) for t in fit.targets)
    fast = [pole for pole in fit.solution[0].poles if pole.real > 0.0 and abs(pole) > top]
    return [f"an unstable mode of {abs(fast[0]):.3g} rad/s lies beyond the band"] if fast else []


def _vague(fit: TransferFunctionFit) -> list[Estimate]:
    """Parameters that speak against a form."""
    return [p for p in fit.estimates if not p.fixed and (p.at_bound or not p.sigma_percent <= UNTOLD)]


def _vague_words(p: Estimate) -> str:
    if p.at_bound:
        return f"{p.name} is on its bound"
    return f"{p.name} is not told (standard deviation {percent(p.sigma_percent).strip()} %)"
