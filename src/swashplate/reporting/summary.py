"""The first screen: banners that nobody may miss, and five lines for a reader with twenty seconds."""

from __future__ import annotations

import math
from collections.abc import Sequence

from swashplate.identification.core.result import Result
from swashplate.identification.core.sources import DataSource, problem_words, scale_words
from swashplate.reporting.figures_validation import middle_horizon
from swashplate.reporting.sections_data import method_words, used_twice
from swashplate.reporting.sections_fit import PRIOR_HEAVY
from swashplate.reporting.words import counted, listed, percent, span_words, value_words
from swashplate.validation.validation import PREDICTORS, Validation

Line = tuple[str, str, str]
_LEVELS = ("good", "usable", "poor", "cannot be judged")
_TONES = {"good": "good", "usable": "caution", "poor": "bad"}


def banners(fit: Result[object, object] | None, validation: Validation | None) -> tuple[tuple[str, str], ...]:
    """What stands above everything else: no aircraft flew; the fit failed; the iterations ran out."""
    lines: list[tuple[str, str]] = []
    flights = (*(fit.data if fit else ()), *(validation.data if validation else ()))
    simulated = [f for f in flights if f.simulated]
    if simulated:
        names = list(dict.fromkeys(f.name or "unnamed" for f in simulated))
        part = "" if len(simulated) == len(flights) else f" ({listed(names)})"
        lines.append(("caution", f"SIMULATED FLIGHT{part}: no aircraft flew for these numbers."))
    twice = used_twice(fit, validation)
    if twice:
        names = list(dict.fromkeys(f.name or "an unnamed flight" for f in twice))
        lines.append(("caution", f"NOT A HOLD-OUT: {listed(names)} was used for the fit too."))
    if fit and fit.failed:
        reasons = " ".join(fit.problems) or "See the parameters."
        lines.append(("bad", f"FAILED FIT: do not use these numbers. {reasons}"))
    elif fit and not fit.converged:
        ended = next((text for text in fit.problems if text.startswith("stopped after")), "")
        lines.append(("caution", f"NOT CONVERGED: {ended or 'the iterations ran out before the fit settled.'}"))
    return tuple(lines)


def summary(fit: Result[object, object] | None, validation: Validation | None) -> tuple[Line, ...]:
    """Five lines (label, words, tone): what was done, how it ended, how it predicts, the verdict, what to beware of."""
    rows = [_what(fit, validation)]
    if fit:
        rows.append(_fit(fit))
    if validation:
        rows += [_prediction(validation), _verdict(validation)]
    elif fit:
        rows.append(
            ("Prediction", "not tested: no flight was held out. Do not trust the model before it is tested.", "caution")
        )
        rows.append(_changes(fit))
    rows.append(_warnings(fit, validation))
    return tuple(rows)


def _names(flights: Sequence[DataSource]) -> str:
    return listed([f"{f.name or 'an unnamed flight'} ({span_words(f)})" for f in flights], most=3)


def _what(fit: Result[object, object] | None, validation: Validation | None) -> Line:
    parts = []
    if fit:
        used = sum(float(c.record.time[-1] - c.record.time[0]) for c in fit.in_time)
        source = f"{used:.1f} s of {_names(fit.data)}" if used else _names(fit.data)
        parts.append(f"{counted(len(fit.names), 'parameter')} of '{fit.model.card.called}' identified from {source}")
    if validation:
        parts.append(
            f"tested on {_names(validation.data)}"
            + (", which the fit never saw" if fit and not used_twice(fit, validation) else "")
        )
    return "What", ", ".join(parts) + ".", "plain"


def _fit(fit: Result[object, object]) -> Line:
    steps = f" in {counted(len(fit.history) - 1, 'iteration')}" if len(fit.history) > 1 else ""
    state = "failed" if fit.failed else ("converged" if fit.converged else "did not converge")
    bounds = [e.name for e in fit.estimates if e.at_bound]
    physics = f"{listed(bounds)} ended at a physical bound" if bounds else "every value lies within its physical bounds"
    tone = "bad" if fit.failed else ("good" if fit.converged and not bounds else "caution")
    took = f" ({fit.seconds:.0f} s)" if fit.seconds else ""  # a saved result does not know
    method = method_words(fit.method).split(" (")[0]
    return "Fit", f"{method.capitalize()} {state}{steps}{took}; {physics}.", tone


def _prediction(validation: Validation) -> Line:
    horizon = middle_horizon(validation)
    scores = {(s.channel, s.predictor): s.fit for s in validation.scores if s.horizon == horizon}
    named = [(name, label) for name, label in _AXES if (name, "model") in scores]
    if not named:
        return "Prediction", "no channel of roll or pitch was predicted.", "caution"
    fits = ", ".join(f"{label} {percent(scores[name, 'model'])} %" for name, label in named)
    rivals = [
        f"{label} {', '.join(percent(scores[name, p]) for name, _ in named)}"
        for p, label in (("published card", "published card"), ("constant rates", "constant rates"))
        if all((name, p) in scores for name, _ in named)
    ]
    beaten = all(
        scores[name, "model"] > scores.get((name, p), -math.inf)
        for name, _ in named
        for p in PREDICTORS
        if p != "model"
    )
    text = f"fit {horizon:g} s ahead: {fits} ({'; '.join([*rivals, 'hold the last value 0'])})."
    return "Prediction", text, "good" if beaten else "caution"


_AXES = (("phi", "roll"), ("theta", "pitch"), ("p", "roll rate"), ("q", "pitch rate"))


def _verdict(validation: Validation) -> Line:
    by_level = {level: [v.axis for v in validation.verdict if v.level == level] for level in _LEVELS}
    parts = [f"{level}: {', '.join(axes)}" for level, axes in by_level.items() if axes]
    # What nobody judged is nothing good: the bar is green only where every axis is.
    worst = next((level for level in ("poor", "usable", "cannot be judged", "good") if by_level[level]), "")
    return "Verdict", ("; ".join(parts) or "no axis was judged") + ".", _TONES.get(worst, "caution")


def _changes(fit: Result[object, object]) -> Line:
    largest = sorted(
        (e for e in fit.estimates if not e.tie and e.best_sigma > 0.0),
        key=lambda e: -abs(e.value - e.start) / e.best_sigma,
    )[:3]
    changes = [f"{e.name} {value_words(e.start)} → {value_words(e.value, e.best_sigma)}" for e in largest]
    return "Change", f"Largest changes for their uncertainty: {'; '.join(changes) or 'nothing'}.", "plain"


def _in_short(problems: str) -> str:
    """The first problem of a log, and how many more there are."""
    first, *others = problems.rstrip(".").split("; ")
    return f"{first}, and {counted(len(others), 'more remark')} on these data" if others else first


def _warnings(fit: Result[object, object] | None, validation: Validation | None) -> Line:
    warnings = []
    if fit:
        blind = list(dict.fromkeys(a.axis for a in getattr(fit.details, "excitation", ()) if not a.identifiable))
        if blind:
            warnings.append(f"no independent excitation in {listed(blind)}")
        heavy = [e.name for e in fit.estimates if e.prior_share > PRIOR_HEAVY and not e.tie]
        if heavy:
            warnings.append(f"the prior, not the flight, decided {listed(heavy, most=5)}")
        if fit.directions:
            warnings.append(f"{counted(len(fit.directions), 'combination')} of parameters hardly seen")
        if any(not c.record.voltage_known for c in fit.in_time):
            warnings.append("battery voltage not logged")
    elif validation and any(not r.voltage_known for r in validation.records):
        warnings.append("battery voltage not logged")
    data = (*(fit.data if fit else ()), *(validation.data if validation else ()))
    warnings += [text.rstrip(".") for text in scale_words(data)]
    warnings += [_in_short(text) for text in problem_words(data)]
    if not warnings:
        return "Warnings", "no problem was found in these flights.", "plain"
    text = "; ".join(warnings)
    return "Warnings", f"{text[0].upper()}{text[1:]}.", "caution"
