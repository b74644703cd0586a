"""Which form of a transfer function the responses ask for: the usual ones are tried, the vague ones not suggested."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from swashplate.identification.core.result import Estimate, percent
from swashplate.identification.frequency.response_cost import ACCEPTABLE, Target
from swashplate.identification.frequency.transfer_function_fit import (
    TransferFunctionFit,
    as_told,
    fit_form,
    targets_of,
)
from swashplate.identification.responses.frequency_response import TWO_PI, FrequencyResponse
from swashplate.models.linear.transfer_function import USUAL, Form

UNTOLD = 100.0
"""Standard deviation in percent above which a parameter speaks against its form."""
_WIDE = 4.0
"""Highest over lowest frequency that must be left above an unstable mode for a form to be fitted there."""
_STILL = 1e-9
BAND = "band_hz"
"""Setting of a fit whose form was suggested for a part of the band only: that part [Hz]."""


@dataclass(frozen=True)
class TriedStructure:
    """One structure that was tried: its form, number of parameters, mean J and the fit; why it is not suggested."""

    form: Form
    parameters: int
    cost: float
    fit: TransferFunctionFit
    unsound: str = ""

    @property
    def unstable(self) -> float:
        """Size of the fastest pole that grows [rad/s]; 0 for a stable form."""
        return max((abs(pole) for pole in self.fit.solution[0].poles if pole.real > _STILL), default=0.0)


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

    An unstable one is suggested only where no stable one costs hardly more. A loop's answer to gusts, below a sweep,
    looks like an unstable aircraft: where no recorded reference rules it out and a stable form is acceptable from twice
    the unstable mode's frequency on, that one is suggested, with its band.

    Returns:
        The suggestion, and all trials by number of parameters.
    """
    wanted = targets_of(responses, input=input, outputs=outputs, band=band, least=least_coherence)
    trials = _trials(wanted, forms, responses, seed=seed, tell=tell)
    best = _pick(trials)
    if best.unstable:
        # Of all that follow better, too: a simple form puts its mode anywhere.
        closest = min((t for t in trials if t.unstable and t.cost <= best.cost), key=lambda t: t.cost)
        low = float(2.0 * closest.unstable / TWO_PI)
        stable: list[TriedStructure] = []
        if responses.method != "joint" and all(t.omega[-1] >= _WIDE * TWO_PI * low for t in wanted):
            ends = (low, _highest(wanted))
            above = targets_of(responses, input=input, outputs=outputs, band=ends, least=least_coherence)
            upper = _trials(above, forms, responses, seed=seed)
            stable = [t for t in upper if not t.unstable and not t.unsound and t.cost <= ACCEPTABLE]
        if stable:
            best = _said(_pick(stable), _BELOW.format(low, closest.unstable, closest.cost))
            best = replace(best, fit=replace(best.fit, settings={**best.fit.settings, BAND: [low, _highest(wanted)]}))
        else:
            others = min((t.cost for t in trials if not t.unstable), default=float("inf"))
            best = _said(best, f"the data demand an unstable model: the best stable form tried has J = {others:.1f}.")
    if best.unsound:
        lacks = "no form that was tried has" if all(t.unsound for t in trials) else "no stable form that follows has"
        best = _said(best, f"{lacks} all its parameters told; of this one, {best.unsound}.")
    return best, tuple(trials)


_BELOW = (
    "from {:.2g} Hz on a stable form follows. Below, the response is that of an unstable mode of {:.2g} rad/s "
    "(J = {:.1f} over the whole band), or what a loop makes of gusts: not of this form. --form fits all of it."
)


def _trials(
    wanted: Sequence[Target],
    forms: Sequence[Form],
    responses: FrequencyResponse,
    *,
    seed: int,
    tell: Callable[[int, int], None] | None = None,
) -> list[TriedStructure]:
    """All forms, by number of parameters."""
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
    return sorted(trials, key=lambda trial: (trial.parameters, trial.cost))


def _pick(trials: Sequence[TriedStructure]) -> TriedStructure:
    """The simplest sound one that costs hardly more than the best; a stable one, even if vague, before an unstable."""
    sound = [trial for trial in trials if not trial.unsound] or list(trials)
    least = min(trial.cost for trial in sound)
    near = max(1.5 * least, least + 10.0)
    of_these = [t for t in sound if t.cost <= near]
    return min((*of_these, *(t for t in trials if t.cost <= near)), key=lambda t: t.unstable > 0.0)


def _highest(targets: Sequence[Target]) -> float:
    return max(float(t.omega[-1]) for t in targets) / TWO_PI


def _said(trial: TriedStructure, warning: str) -> TriedStructure:
    return replace(trial, fit=replace(trial.fit, warnings=(*trial.fit.warnings, warning)))


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
