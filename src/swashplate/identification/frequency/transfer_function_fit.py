"""Transfer functions from frequency responses: one or several outputs, shared poles, structures tried and compared."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar, cast

import numpy as np
import tomli_w

from swashplate.arrays import Array, Complex
from swashplate.errors import IdentificationError
from swashplate.flights.base_units import gain_unit
from swashplate.flights.schema import channel
from swashplate.identification.core.accuracy import sign_words
from swashplate.identification.core.parameter_row import Entry, Row
from swashplate.identification.core.result import Estimate, Result
from swashplate.identification.core.scoring import Optimum, Solver, minimise
from swashplate.identification.core.sources import scale_words
from swashplate.identification.frequency.fit_accuracy import accuracy_of_fit
from swashplate.identification.frequency.response_cost import (
    NOT_FOLLOWED,
    ResponseComparison,
    ResponseCost,
    Target,
    cost_of,
    followed,
    target,
)
from swashplate.identification.frequency.transfer_function_starts import starts
from swashplate.identification.responses.frequency_response import FrequencyResponse
from swashplate.models.linear.linear_vehicle import linear_vehicle
from swashplate.models.linear.state_space import StateSpaceModel
from swashplate.models.linear.state_space_file import parse
from swashplate.models.linear.transfer_function import Form, TransferFunction, TransferFunctions
from swashplate.models.vehicle import Vehicle

_ROUGH, _FOLLOWED = 12, 3
"""Iterations of every start, and how many of them are followed to the end."""

_LONGEST_DELAY = 0.5
"""s: a longer one is no delay of a flying thing."""

_DAMPING = (-2.0, 10.0)
"""Of a pair of roots: from fast growing to far apart."""


@dataclass(frozen=True)
class TransferFunctionDetails:
    """What a fit of transfer functions adds to a result.

    Attributes:
        form: of all of them.
    """

    kind: ClassVar[str] = "transfer functions"
    form: Form

    def lines(self, result: TransferFunctionFit) -> list[str]:
        """What a printed result says of it."""
        return [f"  {model!r}   J = {cost:.1f}" for model, cost in zip(result.solution, result.costs, strict=True)]


TransferFunctionFit = Result[TransferFunctions, TransferFunctionDetails]
"""What `fit_transfer_function` returns: one function per output, poles shared."""


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
    return as_told(fit_form(wanted, form, fixed=dict(fixed or {}), seed=seed), responses)


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
    targets = []
    for name in names:
        one = target(responses, name, input, band=band, least=least)
        if one is None:
            raise IdentificationError(
                f"the coherence reaches {least:g} nowhere over a quarter of an octave"
                + (f" within {band[0]:g}-{band[1]:g} Hz." if band else "."),
                channel=f"{name} / {input}",
                hint="Nothing can be fitted to this response; leave it out or fly a better sweep.",
            )
        targets.append(one)
    return targets


def as_told(fit: TransferFunctionFit, responses: FrequencyResponse) -> TransferFunctionFit:
    """The fit with its gains' units, and with what its responses were warned of: it is no better than they are."""
    pairs = tuple(f"{t.output} / {t.input}:" for t in fit.targets)
    heard = tuple(text for text in (*responses.warnings, *responses.problems) if text.startswith(pairs))
    problems = (*fit.problems, *scale_words(responses.data))
    warned = replace(fit, warnings=(*fit.warnings, *heard), problems=problems, data=responses.data)
    return _with_gain_units(warned, responses)


def _with_gain_units(fit: TransferFunctionFit, responses: FrequencyResponse) -> TransferFunctionFit:
    """The fit with the unit of each gain: output / input / s^(poles and integrators less zeros)."""
    if not responses.output_units:
        return fit
    below = fit.details.form.poles + fit.details.form.integrators - fit.details.form.zeros
    units = {}
    for t in fit.targets:
        o, i = responses.place(t.output, t.input)
        unit = gain_unit(responses.output_units[o] or "1", responses.input_units[i] or "1", below)
        units["K" if len(fit.targets) == 1 else f"K {t.output}"] = unit
    return replace(fit, estimates=tuple(replace(p, unit=units.get(p.name, p.unit)) for p in fit.estimates))


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


def fit_form(targets: Sequence[Target], form: Form, *, fixed: dict[str, float], seed: int) -> TransferFunctionFit:
    shared = form.pole_names
    several = len(targets) > 1
    owner = [{name: f"{name} {t.output}" if several else name for name in form.own_names} for t in targets]
    names = [*(name for of_pair in owner for name in of_pair.values()), *shared]
    spread = {of_pair[name]: fixed[name] for of_pair in owner for name in of_pair if name in fixed}
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

    def models(values: Mapping[str, float]) -> TransferFunctions:
        return TransferFunctions(
            TransferFunction(
                form,
                {n: float(values[of_pair[n]]) for n in form.own_names} | {n: float(values[n]) for n in shared},
                t.output,
                t.input,
            )
            for t, of_pair in zip(targets, owner, strict=True)
        )

    def evaluate(numbers: Array) -> tuple[list[Complex], list[Complex]]:
        values = spread | dict(zip(free, numbers, strict=True))
        answers, slopes = [], []
        for t, of_pair, model in zip(targets, owner, models(values), strict=True):
            h, by_name = model.with_slopes(t.omega)
            column = {of_pair.get(name, name): slope for name, slope in by_name.items()}
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
            rough.append((minimise(cost, Solver(tolerance=1e-2, iterations=_ROUGH)), cost))
    if not rough:
        raise IdentificationError("no starting point of the transfer function gives finite responses.")
    rough.sort(key=lambda end: end[0].cost)
    ends = [(minimise(c, Solver(tolerance=1e-5, iterations=80), start=o.row), c) for o, c in rough[:_FOLLOWED]]
    optimum, cost = min(ends, key=lambda end: end[0].cost)
    fitted = dict(zip(free, optimum.row * cost.row.scale, strict=True))
    values = spread | fitted
    accuracy = accuracy_of_fit(cost, optimum.row)
    place = {name: i for i, name in enumerate(free)}
    estimates = tuple(
        Estimate(name, _unit(name), values[name], values[name], fixed=True)
        if name in spread
        else Estimate(
            name,
            _unit(name),
            cost.row.entries[place[name]].start,
            float(values[name]),
            sigma=float(accuracy.sigma[place[name]]),
            insensitivity=float(accuracy.insensitivity[place[name]]),
            at_bound=name in optimum.at_bound,
        )
        for name in names
    )
    solution = models(values)
    responses = [model.response(t.omega) for model, t in zip(solution, targets, strict=True)]
    costs = tuple(cost_of(h, t) for h, t in zip(responses, targets, strict=True))
    first = {n: cost.row.entries[place[n]].start for n in free}
    failed = not followed(optimum.row, costs)
    return Result(
        method="frequency responses",
        solution=solution,
        start=models({**spread, **first}),
        estimates=estimates,
        names=tuple(free),
        covariance=accuracy.covariance,
        covariance_corrected=np.full_like(accuracy.covariance, np.nan),
        directions=accuracy.directions,
        failed=failed,
        correlation=accuracy.correlation,
        details=TransferFunctionDetails(form),
        history=optimum.history,
        converged=optimum.converged,
        problems=(NOT_FOLLOWED,) if failed else (),
        warnings=(*_fit_warnings(solution, costs, estimates), *accuracy.warnings),
        comparisons=tuple(ResponseComparison(t, h, c) for t, h, c in zip(targets, responses, costs, strict=True)),
        settings={"form": form.text, "fixed": dict(spread), "seed": seed},
    )


def _fit_warnings(
    models: Sequence[TransferFunction], costs: Sequence[float], parameters: Sequence[Estimate]
) -> tuple[str, ...]:
    warnings = [
        f"{m.output} / {m.input}: J = {cost:.0f}, above 100: the structure does not fit."
        for m, cost in zip(models, costs, strict=True)
        if cost > 100.0
    ]
    vague = [p.name for p in parameters if not p.fixed and p.sigma_percent > 20.0]
    if vague:
        warnings.append(f"standard deviation above 20 %: {', '.join(vague)}; fewer parameters may do.")
    warnings += sign_words(parameters)
    bound = [p.name for p in parameters if p.at_bound]
    if bound:
        warnings.append(f"ended on a bound: {', '.join(bound)}.")
    if any(pole.real > 1e-9 for pole in models[0].poles):
        warnings.append("the model is unstable.")
    return tuple(warnings)


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
    poles = np.real(np.atleast_1d(np.poly(fit.solution[0].poles)))
    order = poles.size - 1
    source = fit.solution[0].input
    states = {f"x{k + 1}": "" for k in range(order)}
    equations: dict[str, dict[str, str]] = {f"x{k + 1}": {f"x{k + 2}": "1"} for k in range(order - 1)}
    if order:
        last = {f"x{k + 1}": repr(-float(poles[order - k])) for k in range(order)}
        equations[f"x{order}"] = {**last, source: "1"}
    outputs, delays = {}, {}
    for model, wanted in zip(fit.solution, fit.targets, strict=True):
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
        "title": "; ".join(map(repr, fit.solution)),
        "trust": "Within the band of the fit; a transfer function knows one input.",
        "states": states,
        "inputs": {source: channel(source).unit},
        "equations": equations,
        "outputs": outputs,
        "delays": delays,
        "parameters": {},
    }
    return parse(tomli_w.dumps(document), path=name)


def vehicle_of(result: Result[object, object]) -> Vehicle:
    """What `Result.vehicle` is, for any kind of model."""
    if isinstance(result.solution, Vehicle):
        return result.solution
    return linear_vehicle(
        result.solution
        if isinstance(result.solution, StateSpaceModel)
        else as_state_space(cast(TransferFunctionFit, result))
    )
