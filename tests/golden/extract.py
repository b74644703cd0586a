"""Results as named numbers: one function a type of result, the only place that knows their attributes."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from typer.testing import CliRunner

from swashplate.filtering.disturbances import SEPARATE

from .case import Values, apart, flat, named, thinned

_PERHAPS = (*SEPARATE, "sensor_rate")
"""Numbers of the noise that are zero where a fit has none of them."""


def swash(*arguments: str | Path, code: int = 0) -> str:
    """What a command line of `swash` prints; any other exit code than the one that is expected is an error."""
    from swashplate.cli.app import app

    result = CliRunner().invoke(app, [str(argument) for argument in arguments])
    if result.exit_code != code:
        raise RuntimeError(f"swash {' '.join(map(str, arguments))}: exit code {result.exit_code}\n{result.output}")
    return result.stdout


def swash_json(*arguments: str | Path, code: int = 0) -> Any:
    """The same as JSON, without the files that it names."""
    told = json.loads(swash(*arguments, "--json", code=code))
    return {name: value for name, value in told.items() if name != "written"} if isinstance(told, dict) else told


def of_fit(fit: Any) -> Values:
    """A fit of a vehicle by filter error or output error."""
    found: Values = {
        "converged": bool(fit.converged),
        "failed": bool(fit.failed),
        "iterations": float(len(fit.history)),
        "cost": fit.history[-1],
        "correlation": thinned(fit.correlation, 40),
    }
    for e in fit.estimates:
        found |= {f"{e.name}": e.value, f"{e.name}.sigma": e.sigma, f"{e.name}.sigma_corrected": e.sigma_corrected}
    for k, e in enumerate(fit.constants):
        found |= {f"{k}.{e.name}": e.value, f"{k}.{e.name}.sigma": e.sigma}
    if fit.noise is not None:
        told = [n for n in fit.noise._fields if n not in _PERHAPS or getattr(fit.noise, n) > 0.0]  # others are shared
        found |= apart("noise", (getattr(fit.noise, name) for name in told))
    found["directions"] = [d.sigma for d in fit.directions]
    for k, a in enumerate(fit.details.excitation):
        found |= {f"{k}.{a.axis}.identifiable": bool(a.identifiable)}
        found |= apart(f"{k}.{a.axis}.excitation", (a.explained, a.coherence, a.power))
    for k, c in enumerate(fit.comparisons):
        for i in range(c.model.shape[1]):
            found[f"{k}.model.{i}"] = thinned(c.model[:, i], 5)
    return found


def of_validation(validation: Any) -> Values:
    """Scores by predictor and horizon over the channels, innovations, likelihood, verdicts."""
    found: Values = named("log_likelihood", dict(validation.log_likelihood))
    table: dict[str, list[float]] = {}
    for s in validation.scores:
        if s.predictor != "hold":
            table.setdefault(f"fit.{s.predictor}.{s.horizon:g}s", []).append(s.fit)
        if s.predictor == "model":
            table.setdefault(f"rms.{s.horizon:g}s.{s.channel}", []).append(s.rms)
    found |= {name: values[0] if len(values) == 1 else values for name, values in table.items()}
    for i in validation.innovations:
        found |= apart(f"innovation.{i.channel}", (i.rms, i.expected, i.consistency, i.whiteness))
    found |= {f"verdict.{v.axis}": v.level for v in validation.verdict}
    for k, told in enumerate(validation.calibrated):
        found |= {f"calibrated.{k}.{name}": float(value) for name, value in told._asdict().items()}
    return found


def of_accuracies(parameters: Sequence[Any]) -> Values:
    """Parameters with Cramér-Rao bounds and insensitivities."""
    found: Values = {}
    for p in parameters:
        found |= {p.name: p.value, f"{p.name}.cramer_rao": p.sigma, f"{p.name}.insensitivity": p.insensitivity}
    return found


def of_time_fit(fit: Any) -> Values:
    """A model fitted in time (or, without constants, over frequencies)."""
    found = of_accuracies(fit.estimates) | {"converged": bool(fit.converged), "iterations": float(len(fit.history))}
    found |= apart("variance", np.diag(fit.details.covariance)) if hasattr(fit.details, "covariance") else {}
    records = list(dict.fromkeys(c.record for c in fit.constants if c.record))
    for c in fit.constants:
        place = f"[{records.index(c.record)}]" if c.record else ""
        found[f"constant.{c.name}{place}"] = float(c.value)
    return found | {"cost": fit.history[-1]}


def of_responses(responses: Any, *, most: int = 8) -> Values:
    """Frequency responses at a few lines."""
    found: Values = {"omega": thinned(responses.omega, most), "windows": [float(w) for w in responses.windows]}
    lines = np.unique(np.linspace(0, len(responses.omega) - 1, most).round().astype(int))
    for o, output in enumerate(responses.outputs):
        for i, name in enumerate(responses.inputs):
            pair = f"{output}/{name}"
            found[pair] = thinned(responses.response[lines, o, i], 2 * most)
            found[f"{pair}.coherence"] = thinned(responses.coherence[lines, o, i], most)
            found[f"{pair}.error"] = thinned(responses.error[lines, o, i], most)
    return found | {"warnings": float(len(responses.warnings)), "problems": float(len(responses.problems))}


def of_transfer_function(fit: Any) -> Values:
    """A transfer function fit, models of several outputs one after the other."""
    found = of_accuracies(fit.estimates)
    found |= {"cost": fit.cost, "converged": bool(fit.converged), "correlation": thinned(fit.correlation)}
    return found | {f"poles.{k}": thinned(m.poles) for k, m in enumerate(fit.solution)}


def of_state_space_fit(fit: Any) -> Values:
    """A state-space fit to frequency responses."""
    found = of_accuracies(fit.estimates) | of_state_space(fit.solution)
    found |= {"cost": fit.cost, "costs": [float(c) for c in fit.costs], "converged": bool(fit.converged)}
    return found | {"correlation": thinned(fit.correlation, 40), "dropped": [s.dropped for s in fit.details.reduction]}


def of_state_space(model: Any) -> Values:
    """A state-space model: matrices, eigenvalues, a response."""
    a, b, c, d = model.explicit()
    found: Values = {name: thinned(m, 60) for name, m in (("A", a), ("B", b), ("C", c), ("D", d))}
    found["eigenvalues"] = thinned(model.eigenvalues(), 60)
    return found | {"response": thinned(model.response(np.array([1.0, 10.0])), 40)}


def of_verification(verification: Any) -> Values:
    """A model flown along a record's inputs."""
    found: Values = {"cost": verification.cost}
    for o in verification.outputs:
        found |= apart(o.output, (o.rms, o.theil, o.fit))
    for k, t in enumerate(verification.traces):
        for i in range(t.model.shape[1]):
            found[f"{k}.model.{i}"] = thinned(t.model[:, i], 8)
        found |= named(f"{k}.bias", dict(t.biases)) | named(f"{k}.shift", dict(t.shifts))
    return found


def of_flight(flight: Any, *, channels: Sequence[str] | None = None, most: int = 12) -> Values:
    """Every channel of a flight at a few samples."""
    found: Values = {}
    for name, data in flight.streams.items():
        for channel in data.data_vars:
            if channels is None or channel in channels:
                found[f"{name}.{channel}"] = thinned(data[channel].values, most)
        found[f"{name}.samples"] = float(data.sizes["time"])
    return found


def of_json(document: Any, *, without: Sequence[str] = (), most: int = 24) -> Values:
    """A JSON document without what differs from run to run."""
    return flat(document, without=("seconds", "source", "sha256", "path", "created", *without), most=most)
