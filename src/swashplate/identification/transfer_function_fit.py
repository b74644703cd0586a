"""Transfer functions from frequency responses: one or several outputs, shared poles, structures tried and compared."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import tomli_w

from swashplate.errors import IdentificationError
from swashplate.flights.base_units import gain_unit
from swashplate.flights.flight import Array
from swashplate.flights.schema import channel
from swashplate.identification.frequency_response import FrequencyResponse
from swashplate.identification.response_cost import (
    ParameterAccuracy,
    ResponseCost,
    Target,
    accuracy_of,
    cost_of,
    percent,
    target,
)
from swashplate.identification.rows import Entry, Row
from swashplate.identification.scoring import Optimum, minimise
from swashplate.identification.spectra import Complex
from swashplate.identification.state_space import StateSpaceModel
from swashplate.identification.state_space_file import parse
from swashplate.identification.transfer_function import USUAL, Form, TransferFunction
from swashplate.identification.transfer_function_starts import starts

_ROUGH, _FOLLOWED = 12, 3
"""Iterations of every start, and how many of them are followed to the end."""

_LONGEST_DELAY = 0.5
"""s: a longer one is no delay of a flying thing."""

_DAMPING = (-2.0, 10.0)
"""Of a pair of roots: from fast growing to far apart."""


@dataclass(frozen=True)
class TransferFunctionFit:
    """Fitted transfer functions of one input.

    Attributes:
        models: one per output, poles shared.
        targets: the measured responses that they were fitted to.
        costs: J of each.
        parameters: numbers with their bounds, shared poles once.
        correlation: of the free parameters, in the order of `parameters` without the fixed ones.
        converged: False where the iterations ran out.
        warnings: what a reader must know.
    """

    models: tuple[TransferFunction, ...]
    targets: tuple[Target, ...]
    costs: tuple[float, ...]
    parameters: tuple[ParameterAccuracy, ...]
    correlation: Array
    converged: bool
    warnings: tuple[str, ...] = ()

    @property
    def cost(self) -> float:
        """Mean J."""
        return float(np.mean(self.costs))

    @property
    def form(self) -> Form:
        return self.models[0].form

    def as_dict(self) -> dict[str, Any]:
        """Numbers and words as JSON types."""
        return {
            "kind": "transfer-function",
            "form": self.form.text,
            "models": [
                {"output": m.output, "input": m.input, "values": dict(m.values), "text": repr(m), "J": cost}
                for m, cost in zip(self.models, self.costs, strict=True)
            ],
            "parameters": [vars(parameter) for parameter in self.parameters],
            "converged": self.converged,
            "warnings": list(self.warnings),
        }

    def __repr__(self) -> str:
        lines = [f"{model!r}   J = {cost:.1f}" for model, cost in zip(self.models, self.costs, strict=True)]
        lines.append(f"  {'parameter':<24}{'value':>12}{'CR %':>9}{'I %':>9}  unit")
        for p in self.parameters:
            free = percent(p.cramer_rao_percent, width=9) + percent(p.insensitivity_percent, width=9)
            cells = f"{'fixed':>9}{'':>9}" if p.fixed else free
            bound = "  at its bound" if p.at_bound else ""
            lines.append(f"  {p.name:<24}{p.value:>12.5g}{cells}  {p.unit}{bound}".rstrip())
        return "\n".join([*lines, *(f"! {text}" for text in self.warnings)])


@dataclass(frozen=True)
class Trial:
    """One structure that was tried: its form, number of parameters, mean J and the fit."""

    form: Form
    parameters: int
    cost: float
    fit: TransferFunctionFit


def fit_transfer_function(
    responses: FrequencyResponse,
    form: Form | str,
    *,
    input: str,
    outputs: Sequence[str] | None = None,
    band: tuple[float, float] | None = None,
    fixed: Mapping[str, float] | None = None,
    least_coherence: float = 0.6,
    seed: int = 0,
) -> TransferFunctionFit:
    """Fit transfer functions of one input; several outputs share their poles.

    Args:
        responses: from `respond`.
        form: of all outputs, e.g. "1/2".
        input: the input channel.
        outputs: all outputs where None.
        band: limits [Hz] within each response's coherent band.
        fixed: values of parameters that are not to move, e.g. {"tau": 0.05} (several outputs: "tau p" for one).
        least_coherence: from which a response is used.
        seed: of the starting points.

    Raises:
        IdentificationError: no coherent response, or a fixed name that the form does not have.
    """
    form = Form.parse(form) if isinstance(form, str) else form
    wanted = targets_of(responses, input=input, outputs=outputs, band=band, least=least_coherence)
    return _as_told(_fit(wanted, form, fixed=dict(fixed or {}), seed=seed), responses)


def targets_of(
    responses: FrequencyResponse,
    *,
    input: str,
    outputs: Sequence[str] | None = None,
    band: tuple[float, float] | None = None,
    least: float = 0.6,
) -> list[Target]:
    """The coherent responses of outputs to one input.

    Raises:
        IdentificationError: where one has no coherent band.
    """
    names = tuple(outputs) if outputs else responses.outputs
    found = []
    for name in names:
        one = target(responses, name, input, band=band, least=least)
        if one is None:
            raise IdentificationError(
                f"the coherence reaches {least:g} nowhere over a quarter of an octave"
                + (f" within {band[0]:g}-{band[1]:g} Hz." if band else "."),
                channel=f"{name} / {input}",
                hint="Nothing can be fitted to this response; leave it out or fly a better sweep.",
            )
        found.append(one)
    return found


def suggest(
    responses: FrequencyResponse,
    *,
    input: str,
    outputs: Sequence[str] | None = None,
    band: tuple[float, float] | None = None,
    forms: Sequence[Form] = USUAL,
    least_coherence: float = 0.6,
    seed: int = 0,
) -> tuple[Trial, tuple[Trial, ...]]:
    """The usual structures tried, and the one with the fewest parameters that costs hardly more than the best.

    Hardly: J within 10 of, or within 1.5 times, the least J of all (the pair of Tischler and Remple's "acceptable" and
    "indistinguishable" lies a factor of two apart).

    Returns:
        The suggestion, and all trials by number of parameters.
    """
    wanted = targets_of(responses, input=input, outputs=outputs, band=band, least=least_coherence)
    trials = []
    for form in forms:
        fit = _as_told(_fit(wanted, form, fixed={}, seed=seed), responses)
        trials.append(Trial(form, len(fit.parameters), fit.cost, fit))
    trials.sort(key=lambda trial: (trial.parameters, trial.cost))
    least = min(trial.cost for trial in trials)
    good = [trial for trial in trials if trial.cost <= max(1.5 * least, least + 10.0)]
    return good[0], tuple(trials)


def _as_told(fit: TransferFunctionFit, responses: FrequencyResponse) -> TransferFunctionFit:
    """The fit with its gains' units, and with what its responses were warned of: it is no better than they are."""
    pairs = tuple(f"{t.output} / {t.input}:" for t in fit.targets)
    heard = tuple(words for words in (*responses.warnings, *responses.problems) if words.startswith(pairs))
    return _with_gain_units(replace(fit, warnings=(*fit.warnings, *heard)), responses)


def _with_gain_units(fit: TransferFunctionFit, responses: FrequencyResponse) -> TransferFunctionFit:
    """The fit with the unit of each gain: output / input / s^(poles and integrators less zeros)."""
    if not responses.output_units:
        return fit
    below = fit.form.poles + fit.form.integrators - fit.form.zeros
    units = {}
    for t in fit.targets:
        o, i = responses.place(t.output, t.input)
        unit = gain_unit(responses.output_units[o] or "1", responses.input_units[i] or "1", below)
        units["K" if len(fit.targets) == 1 else f"K {t.output}"] = unit
    return replace(fit, parameters=tuple(replace(p, unit=units.get(p.name, p.unit)) for p in fit.parameters))


def _check_fixed(form: Form, values: Mapping[str, float]) -> None:
    """That held numbers can belong to something that flies; a negative damping is an unstable mode and may."""
    for name, value in values.items():
        kind = name.split(" ")[0].split("_")[0]
        bounds = {"tau": (0.0, _LONGEST_DELAY), "omega": (0.0, np.inf), "zeta": _DAMPING}
        low, high = bounds.get(kind, (-np.inf, np.inf))
        if not low <= value <= high or (kind in ("omega", "K") and value == 0.0):
            expected = {"K": "other than 0", "omega": "above 0 rad/s", "tau": f"{low:g} to {high:g} s"}
            raise IdentificationError(
                f"is held at {value:g}, expected {expected.get(kind, f'{low:g} to {high:g}')} in the form {form.text}.",
                channel=name,
                hint="Give another value, or let it be found.",
            )


def _fit(targets: Sequence[Target], form: Form, *, fixed: dict[str, float], seed: int) -> TransferFunctionFit:
    shared = form.pole_names
    several = len(targets) > 1
    owner = [{name: f"{name} {t.output}" if several else name for name in form.own_names} for t in targets]
    names = [*(name for own in owner for name in own.values()), *shared]
    spread = {own[name]: fixed[name] for own in owner for name in own if name in fixed}
    spread |= {name: value for name, value in fixed.items() if name in names}
    unknown = sorted(set(fixed) - set(names) - set(form.own_names))
    if unknown:
        raise IdentificationError(
            f"is no parameter of the form {form.text}; it has {', '.join(names)}.", channel=", ".join(unknown)
        )
    _check_fixed(form, spread)
    free = [name for name in names if name not in spread]
    if not free:
        raise IdentificationError(
            f"every parameter of the form {form.text} is held: there is nothing to fit.", hint="Let one move."
        )

    def models(values: Mapping[str, float]) -> list[TransferFunction]:
        return [
            TransferFunction(
                form,
                {n: float(values[own[n]]) for n in form.own_names} | {n: float(values[n]) for n in shared},
                t.output,
                t.input,
            )
            for t, own in zip(targets, owner, strict=True)
        ]

    def evaluate(numbers: Array) -> tuple[list[Complex], list[Complex]]:
        values = spread | dict(zip(free, numbers, strict=True))
        answers, slopes = [], []
        for t, own, model in zip(targets, owner, models(values), strict=True):
            h, by_name = model.with_slopes(t.omega)
            column = {own.get(name, name): slope for name, slope in by_name.items()}
            zero = np.zeros(t.omega.size, dtype=np.complex128)
            answers.append(h)
            slopes.append(np.stack([column.get(name, zero) for name in free], axis=1))
        return answers, slopes

    rough: list[tuple[Optimum, ResponseCost]] = []
    for start in starts(targets, form, owner, seed=seed, longest_delay=_LONGEST_DELAY):
        numbers = {**start, **spread}
        row = Row(tuple(_entry(name, numbers[name], targets) for name in free))
        cost = ResponseCost(row, targets, evaluate)
        if np.isfinite(cost.cost(row.starts())):
            rough.append((minimise(cost, tolerance=1e-2, iterations=_ROUGH), cost))
    if not rough:
        raise IdentificationError("no starting point of the transfer function gives finite responses.")
    rough.sort(key=lambda end: end[0].cost)
    ends = [(minimise(c, start=o.row, tolerance=1e-5, iterations=80), c) for o, c in rough[:_FOLLOWED]]
    optimum, cost = min(ends, key=lambda end: end[0].cost)
    found = dict(zip(free, optimum.row * cost.row.scale, strict=True))
    values = spread | found
    _, slopes = cost.residuals(optimum.row)
    bounds = accuracy_of(slopes / cost.row.scale)
    place = {name: i for i, name in enumerate(free)}
    parameters = tuple(
        ParameterAccuracy(name, _unit(name), values[name], values[name], fixed=True)
        if name in spread
        else ParameterAccuracy(
            name,
            _unit(name),
            cost.row.entries[place[name]].start,
            float(values[name]),
            float(bounds[0][place[name]]),
            float(bounds[1][place[name]]),
            at_bound=name in optimum.at_bound,
        )
        for name in names
    )
    made = tuple(models(values))
    costs = tuple(cost_of(model.response(t.omega), t) for model, t in zip(made, targets, strict=True))
    return TransferFunctionFit(
        made, tuple(targets), costs, parameters, bounds[2], optimum.converged, _words(made, costs, parameters)
    )


def _words(
    models: Sequence[TransferFunction], costs: Sequence[float], parameters: Sequence[ParameterAccuracy]
) -> tuple[str, ...]:
    words = [
        f"{m.output} / {m.input}: J = {cost:.0f}, above 100: the structure does not fit."
        for m, cost in zip(models, costs, strict=True)
        if cost > 100.0
    ]
    vague = [p.name for p in parameters if not p.fixed and p.cramer_rao_percent > 20.0]
    if vague:
        words.append(f"Cramér-Rao bound above 20 %: {', '.join(vague)}; fewer parameters may do.")
    if any(pole.real > 1e-9 for pole in models[0].poles):
        words.append("the model is unstable.")
    return tuple(words)


def _unit(name: str) -> str:
    kind = name.split(" ")[0].split("_")[0]
    return {"tau": "s", "zero": "1/s", "pole": "1/s", "omega": "rad/s", "zeta": "1"}.get(kind, "")


def _entry(name: str, value: float, targets: Sequence[Target]) -> Entry:
    low, high = min(t.omega[0] for t in targets), max(t.omega[-1] for t in targets)
    kind = name.split(" ")[0].split("_")[0]
    if kind == "tau":
        return Entry(name, "parameter", value, 0.05, 0.0, _LONGEST_DELAY)
    if kind == "zeta":
        return Entry(name, "parameter", value, 0.3, *_DAMPING)
    if kind == "omega":
        return Entry(name, "parameter", value, max(abs(value), low) / 2.0, low / 100.0, high * 30.0)
    if kind in ("zero", "pole"):
        return Entry(name, "parameter", value, max(abs(value), low) / 2.0, -high * 30.0, high * 30.0)
    return Entry(name, "parameter", value, abs(value) / 2.0)


def as_state_space(fit: TransferFunctionFit, *, name: str = "transfer_function") -> StateSpaceModel:
    """The fitted transfer functions as one model (controllable canonical form), to be saved, flown and verified.

    Raises:
        IdentificationError: more zeros than poles: such a model has no states that could be flown.
    """
    poles = np.real(np.atleast_1d(np.poly(fit.models[0].poles)))
    order = poles.size - 1
    source = fit.models[0].input
    states = {f"x{k + 1}": "" for k in range(order)}
    equations: dict[str, dict[str, str]] = {f"x{k + 1}": {f"x{k + 2}": "1"} for k in range(order - 1)}
    if order:
        last = {f"x{k + 1}": repr(-float(poles[order - k])) for k in range(order)}
        equations[f"x{order}"] = {**last, source: "1"}
    outputs, delays = {}, {}
    for model, wanted in zip(fit.models, fit.targets, strict=True):
        top = model.coefficients[0]
        if top.size > order + 1:
            raise IdentificationError(
                f"{model.output} / {model.input} has {top.size - 1} zeros over {order} poles: it cannot be flown."
            )
        top = np.concatenate([np.zeros(order + 1 - top.size), top])
        through = float(top[0])
        row = {f"x{k + 1}": repr(float(top[order - k] - through * poles[order - k])) for k in range(order)}
        outputs[wanted.output] = {"unit": channel(wanted.output).unit, "of": {**row, source: repr(through)}}
        delays[f"{model.output}/{model.input}"] = repr(float(model.values.get("tau", 0.0)))
    document = {
        "kind": "state-space",
        "name": name,
        "title": "; ".join(map(repr, fit.models)),
        "trust": "Within the band of the fit; a transfer function knows one input.",
        "states": states,
        "inputs": {source: channel(source).unit},
        "equations": equations,
        "outputs": outputs,
        "delays": delays,
        "parameters": {},
    }
    return parse(tomli_w.dumps(document), path=name)
