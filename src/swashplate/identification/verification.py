"""Verification in time: an identified linear model flown along a record that no fit has seen.

The record's reference is not the model's trim: constant biases of the outputs, constant shifts of the states' rates and
the state at the start are solved for by least squares, as the book does (Tischler and Remple 2012, ch. 14). They are
constants; everything that moves has to come from the model and the recorded inputs.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from swashplate.errors import FlightError
from swashplate.flights.filters import filtered
from swashplate.flights.flight import Array, Flight
from swashplate.identification.linear_simulation import delayed, free_and_forced
from swashplate.identification.records import uniform_table
from swashplate.identification.response_warnings import damaged
from swashplate.identification.state_space import StateSpaceModel

GOOD_J, GOOD_TIC = 2.0, 0.30
"""J_rms and Theil's coefficient up to which a rotorcraft model is called good (Tischler and Remple 2012)."""

_WEIGHT = {"rad": np.degrees(1.0), "rad/s": np.degrees(1.0), "m/s": 1.0 / 0.3048, "m/s^2": 1.0 / 0.3048}
"""1 deg, 1 deg/s, 1 ft/s and 1 ft/s^2 weigh alike."""

_TOP, _ORDER = 0.45, 3
"""Highest corner of a band as a share of the sample rate, and order of its filter (each way)."""

GROWTH = 3.0
"""Times that an unstable mode may grow by e before the record is cut: beyond, the shifts would be all that is seen."""


@dataclass(frozen=True)
class OutputVerification:
    """One output over all records.

    Attributes:
        output, unit: the channel. rms: of the error [unit]. theil: rms(error) / (rms(flight) + rms(model)).
        fit: 100 (1 - rms error / rms of the flight) [%].
    """

    output: str
    unit: str
    rms: float
    theil: float
    fit: float


@dataclass(frozen=True)
class Trace:
    """One stretch: time [s], flight and model (n, n_outputs), inputs (n, n_inputs), what was solved for."""

    source: str
    time: Array
    flight: Array
    model: Array
    inputs: Array
    biases: Mapping[str, float]
    shifts: Mapping[str, float]


@dataclass(frozen=True)
class Verification:
    """How an identified model follows unseen records.

    Attributes:
        model: what was flown. cost: J_rms. outputs: per output. traces: to look at.
        warnings: what a reader must know. flights: the conditioned records.
        inside: the same within the fitted band alone, where one was asked for.
    """

    model: StateSpaceModel
    cost: float
    outputs: tuple[OutputVerification, ...]
    traces: tuple[Trace, ...]
    warnings: tuple[str, ...]
    flights: tuple[Flight, ...]
    settings: Mapping[str, Any] = field(default_factory=dict)
    inside: Verification | None = None

    @property
    def good(self) -> bool:
        """Whether the book would call it good."""
        return self.cost <= GOOD_J and all(o.theil <= GOOD_TIC for o in self.outputs)

    def __getitem__(self, output: str) -> OutputVerification:
        return next(o for o in self.outputs if o.output == output)

    def as_dict(self) -> dict[str, Any]:
        """Numbers and words as JSON types (no time histories)."""
        return {
            "kind": "verification",
            "model": self.model.name,
            "J_rms": self.cost,
            "good": self.good,
            "outputs": [vars(o) for o in self.outputs],
            "records": [{"source": t.source, "biases": dict(t.biases), "shifts": dict(t.shifts)} for t in self.traces],
            "warnings": list(self.warnings),
            "flights": [vars(f.provenance) | {"history": [vars(s) for s in f.history]} for f in self.flights],
            "band_hz": self.settings.get("band_hz"),
            "inside_band": None if self.inside is None else self.inside.as_dict() | {"flights": []},
        }

    def __repr__(self) -> str:
        band = self.settings.get("band_hz")
        where = " between {:g} and {:g} Hz".format(*band) if band else ""
        lines = [f"{self.model.name} in time{where}: J_rms = {self.cost:.2f} (good up to {GOOD_J:g})"]
        lines.append(f"  {'output':<10}{'rms error':>12}  {'unit':<8}{'Theil':>7}{'fit %':>8}")
        for o in self.outputs:
            lines.append(f"  {o.output:<10}{o.rms:>12.4g}  {o.unit:<8}{o.theil:>7.2f}{o.fit:>8.1f}")
        lines += [f"! {text}" for text in self.warnings]
        return "\n".join(lines if self.inside is None else [*lines, repr(self.inside)])


def verify_inside(
    model: StateSpaceModel, flights: Flight | Sequence[Flight], *, band: tuple[float, float] | None
) -> Verification:
    """`verify` on the records as they are and, where the model was fitted over a band, within that band too.

    What a model does outside its band is not told by the fit: a record's slow drift, say, which a loop fights with
    commands that a near-integrator then adds up.
    """
    whole = verify(model, flights)
    return whole if band is None else replace(whole, inside=verify(model, flights, band=band))


def verify(
    model: StateSpaceModel,
    flights: Flight | Sequence[Flight],
    *,
    outputs: Sequence[str] | None = None,
    shifts: bool = True,
    band: tuple[float, float] | None = None,
) -> Verification:
    """Fly a model along recorded inputs and compare.

    Args:
        model: an identified model.
        flights: conditioned; not used for the fit.
        outputs: which to compare; all that model and flights share where None.
        shifts: solve for constant shifts of the states' rates too (else for output biases and start states only).
        band: limits [Hz] within which inputs and outputs are compared (filtered alike, without phase); all where None.

    Raises:
        FlightError: an input that the flights lack, or no output that both have.
    """
    flights = (flights,) if isinstance(flights, Flight) else tuple(flights)
    shared = tuple(n for n in (outputs or model.outputs) if all(n in f for f in flights) and n in model.outputs)
    if not shared:
        raise FlightError(
            f"flight and model share no output; the model has {', '.join(model.outputs)}.",
            where=flights[0].provenance.source or None,
            hint="Map the flight's columns to these names.",
        )
    growth = float(max(0.0, *model.eigenvalues().real, 0.0))
    warnings = damaged(flights) if band is None else []  # said once
    traces = []
    for flight in flights:
        for piece in flight.split():
            time, table = uniform_table(piece, (*model.inputs, *shared), who=f"'{model.name}'")
            dt = float((time[-1] - time[0]) / (time.size - 1))
            if band is not None:
                table = filtered(table, rate=1.0 / dt, cutoff=(band[0], min(band[1], _TOP / dt)), order=_ORDER)
            longest = time.size if growth * (time[-1] - time[0]) <= GROWTH else max(20, int(GROWTH / growth / dt))
            if longest < time.size:
                text = (
                    f"the model grows by e in {1.0 / growth:.2g} s: records are cut into stretches of "
                    f"{longest * dt:.3g} s, each with its own start."
                )
                warnings += [text] if text not in warnings else []
            for first in range(0, time.size - longest // 2, longest):
                part = slice(first, first + longest)
                name = f"{piece.provenance.source or 'flight'} {time[part][0]:.2f}-{time[part][-1]:.2f} s"
                traces.append(_flown(model, shared, name, time[part], table[part], dt, shifts))
    judged = _judged(model, shared, traces)
    lost = [f"{o.output} ({o.theil:.2f})" for o in judged if o.theil > GOOD_TIC]
    if lost:
        warnings.append(
            f"Theil's coefficient above {GOOD_TIC:g}: {', '.join(lost)}. The model does not follow them, or what moved "
            f"them was no input (gusts)."
        )
    weight = np.array([_WEIGHT.get(model.units.get(n, ""), 1.0) for n in shared])
    errors = np.concatenate([t.flight - t.model for t in traces]) * weight
    return Verification(
        model=model,
        cost=float(np.sqrt(np.mean(errors**2))),
        outputs=judged,
        traces=tuple(traces),
        warnings=tuple(warnings),
        flights=flights,
        settings={"outputs": list(shared), "shifts": shifts, "band_hz": list(band) if band else None},
    )


def _flown(
    model: StateSpaceModel, outputs: tuple[str, ...], name: str, time: Array, table: Array, dt: float, shifts: bool
) -> Trace:
    m, n = len(model.inputs), len(model.states)
    inputs, measured = table[:, :m], table[:, m:]
    moved = inputs - inputs.mean(axis=0)
    a, b, c, d = model.explicit()
    rows = [model.outputs.index(o) for o in outputs]
    lags = np.array([[model.delay(o, i) / dt for i in model.inputs] for o in outputs])
    answer = np.zeros_like(measured)
    started = pushed = np.zeros((time.size, n, n))
    # Outputs whose inputs come equally late share one run.
    for lag in {tuple(row) for row in lags}:
        late = np.column_stack([delayed(moved[:, j], lag[j]) for j in range(m)])
        forced, started, pushed = free_and_forced(a, b, late, dt)
        for k, row in enumerate(rows):
            if tuple(lags[k]) == lag:
                answer[:, k] = forced @ c[row] + late @ d[row]
    k = len(outputs)
    columns = [np.einsum("on,tnj->toj", c[rows], started)]
    columns += [np.einsum("on,tnj->toj", c[rows], pushed)] if shifts else []
    columns.append(np.broadcast_to(np.eye(k), (time.size, k, k)))
    basis = np.concatenate(columns, axis=2)
    weight = np.array([_WEIGHT.get(model.units.get(o, ""), 1.0) for o in outputs])
    flat = (basis * weight[None, :, None]).reshape(time.size * k, -1)
    size = np.maximum(np.linalg.norm(flat, axis=0), 1e-300)
    solved = np.linalg.lstsq(flat / size, ((measured - answer) * weight).ravel(), rcond=1e-8)[0] / size
    return Trace(
        source=name,
        time=time,
        flight=measured,
        model=answer + basis @ solved,
        inputs=inputs,
        biases=dict(zip(outputs, map(float, solved[-k:]), strict=True)),
        shifts=dict(zip(model.states, map(float, solved[n : 2 * n]), strict=True)) if shifts else {},
    )


def _judged(
    model: StateSpaceModel, outputs: tuple[str, ...], traces: Sequence[Trace]
) -> tuple[OutputVerification, ...]:
    made = []
    for k, name in enumerate(outputs):
        # Deviations from each stretch's own mean: a bias that was solved for is no merit.
        y = np.concatenate([t.flight[:, k] - t.flight[:, k].mean() for t in traces])
        model_y = np.concatenate([t.model[:, k] - t.flight[:, k].mean() for t in traces])
        error, flight, own = (float(np.sqrt(np.mean(np.square(v)))) for v in (y - model_y, y, model_y))
        made.append(
            OutputVerification(
                name,
                model.units.get(name, ""),
                error,
                error / max(flight + own, 1e-300),
                100.0 * (1.0 - error / max(flight, 1e-300)),
            )
        )
    return tuple(made)
