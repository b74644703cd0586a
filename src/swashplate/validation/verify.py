"""Verification in time: an identified linear model flown along a record that no fit has seen.

Two questions. Does the record refute the model? One-step predictions behind one noise filter tell (`refutation`). How
close does it come? It is flown along stretches of one length, whatever the model is like. The record's reference is not
the model's trim: constant biases of the outputs, constant shifts of the modes' rates and one constant of each mode are
solved for by least squares, as the book does (Tischler and Remple 2012, ch. 14), and so they are for a rival whose
controls do nothing. Everything else that moves has to come from the model and the recorded inputs.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from swashplate.arrays import Array
from swashplate.errors import FlightError
from swashplate.flights.conditioning.filters import filtered
from swashplate.flights.excitation import excitations, of_inputs
from swashplate.flights.feedback import share_of
from swashplate.flights.flight import Flight, as_flights
from swashplate.identification.core.record_facts import bystanders_of
from swashplate.identification.core.records import uniform_table
from swashplate.identification.core.sources import DataSource, sources_of
from swashplate.identification.responses.response_warnings import damaged
from swashplate.identification.time.linear_simulation import answers
from swashplate.models.linear.linear_vehicle import structure_of
from swashplate.models.linear.state_space import StateSpaceModel
from swashplate.models.vehicle import Vehicle
from swashplate.validation.black_box import CROSSED, Ceiling, ceiling_along
from swashplate.validation.floors import Floor, floors
from swashplate.validation.noise_filter import Piece
from swashplate.validation.refutation import OPEN, REFUTED, Judgement, judge
from swashplate.validation.verification import GOOD_TIC, OutputVerification, Trace, Verification

MUCH = 0.3
"""Share of what a model leaves from which an input that it does not have is named."""


def other_inputs(
    flights: Sequence[Flight], inputs: Sequence[str], errors: Mapping[str, Sequence[tuple[Array, Array]]]
) -> dict[str, str]:
    """By output, the inputs to add to a model, in words; outputs that no other input moved are left out.

    An input that a controller moved is none: it answers the gusts that moved the output, too.

    Args:
        flights: at one rate, with all that was logged on the inputs' time base.
        inputs: of the model.
        errors: of the model by output, each as stamps [s] and values of stretches, in the flights' order.
    """
    others = bystanders_of(flights, (*inputs, *errors))
    excitation = of_inputs(excitations(flights, others, outputs=tuple(errors))) if others else {}
    explanations: dict[str, str] = {}
    for output, stretches in errors.items():
        movers = []
        for name in (n for n in others if excitation[n].outside):
            left = total = 0.0
            for flight, (time, error) in zip(flights, stretches, strict=True):
                command = np.interp(time, flight.time(name), flight.values(name))
                share = share_of(error, command[:, None], float(time[1] - time[0]))
                total += float(np.sum(error**2))
                left += float(np.sum(error**2)) * (1.0 - max(np.nan_to_num(share), 0.0))
            if total > 0.0 and 1.0 - left / total >= MUCH:
                movers.append((1.0 - left / total, name))
        if movers:
            names = ", ".join(f"'{name}' ({100.0 * share:.0f} %)" for share, name in sorted(movers, reverse=True))
            explanations[output] = (
                f"of what the model leaves of {output}, other inputs explain much: {names}. Add them to it."
            )
    return explanations


_WEIGHT = {"rad": np.degrees(1.0), "rad/s": np.degrees(1.0), "m/s": 1.0 / 0.3048, "m/s^2": 1.0 / 0.3048}
"""1 deg, 1 deg/s, 1 ft/s and 1 ft/s^2 weigh alike."""

_TOP, _ORDER = 0.45, 3
"""Highest corner of a band as a share of the sample rate, and order of its filter (each way)."""

PERIODS, LOW = 3.0, 0.1
"""Periods of the band's low end in one stretch, and that low end [Hz] where no band is given."""

HOLD, HOLD_RATE, NO_CONTROL = "hold", "hold rate", "no control"
"""Naive rivals: the mean, a straight line, the model's own motion with the controls still (all by least squares)."""


def verify_inside(
    model: StateSpaceModel, flights: Flight | Sequence[Flight], *, band: tuple[float, float] | None
) -> Verification:
    """`verify` on the records as they are and, where the model was fitted over a band, within that band too.

    What a model does outside its band is not told by the fit: a record's slow drift, say, which a loop fights with
    commands that a near-integrator then adds up. The verdict is on the band.
    """
    everywhere = verify(model, flights, low=band[0] if band else None, judged=band is None)
    if band is None:
        return everywhere
    inside = verify(model, flights, band=band)
    return replace(everywhere, inside=inside, judgement=inside.judgement)


def verify(
    model: Vehicle | StateSpaceModel,
    flights: Flight | Sequence[Flight],
    *,
    outputs: Sequence[str] | None = None,
    shifts: bool = True,
    band: tuple[float, float] | None = None,
    low: float | None = None,
    judged: bool = True,
) -> Verification:
    """Fly a model along recorded inputs and compare; judge whether the records refute it.

    Args:
        model: an identified model: a vehicle of a state-space file, or what it is made of.
        flights: conditioned; not used for the fit.
        outputs: which to compare; all that model and flights share where None.
        shifts: solve for constant shifts of the modes' rates too (else for biases and the modes' constants only).
        band: limits [Hz] within which inputs and outputs are compared (filtered alike, without phase); all where None.
        low: lowest frequency of interest [Hz], of which a stretch holds three periods; the band's, or 0.1, where None.
        judged: ask the records whether they refute it; the verdict is "cannot be judged" otherwise.

    Raises:
        FlightError: an input that the flights lack, no output that both have, or flights at different rates.
    """
    flights, model = as_flights(flights), structure_of(model)
    if not flights:
        raise FlightError("there is no flight to verify the model on.", where=model.name)
    shared = tuple(n for n in (outputs or model.outputs) if all(n in f for f in flights) and n in model.outputs)
    if not shared:
        raise FlightError(
            f"flight and model share no output; the model has {', '.join(model.outputs)}.",
            where=flights[0].provenance.source or None,
            hint="Map the flight's columns to these names.",
        )
    data = sources_of(flights)
    warnings = damaged(data) if band is None else []  # said once
    stretch = PERIODS / (low or (band[0] if band else LOW))
    m = len(model.inputs)
    traces: list[Trace] = []
    owners: list[Flight] = []
    pieces: list[Piece] = []
    costs: dict[str, list[Array]] = {HOLD: [], HOLD_RATE: [], NO_CONTROL: []}
    constants = 0
    weight = np.array([_WEIGHT.get(model.units.get(n, ""), 1.0) for n in shared])
    for flight in flights:
        for piece in flight.split():
            time, table = uniform_table(piece, (*model.inputs, *shared), who=f"'{model.name}'")
            dt = float((time[-1] - time[0]) / (time.size - 1))
            source = piece.provenance.source or "flight"
            deviation = table - table.mean(axis=0)
            outside = any(one.outside for one in excitations(piece, model.inputs, outputs=shared))
            pieces.append(Piece(source, deviation[:, :m], deviation[:, m:], dt, outside))
            if band is not None:
                table = filtered(table, rate=1.0 / dt, cutoff=(band[0], min(band[1], _TOP / dt)), order=_ORDER)
            count = max(1, round(time.size * dt / stretch))
            for part in np.array_split(np.arange(time.size), count):
                name = f"{source} {time[part][0]:.2f}-{time[part][-1]:.2f} s"
                trace, still, free = _along_records(model, shared, name, time[part], table[part], dt, shifts)
                traces.append(trace)
                owners.append(piece)
                constants += free
                costs[NO_CONTROL].append(still * weight)
                ramp = np.linspace(-1.0, 1.0, part.size)[:, None]
                level = trace.flight - trace.flight.mean(axis=0)
                costs[HOLD].append(level * weight)
                costs[HOLD_RATE].append((level - ramp * (ramp.T @ level) / np.sum(ramp**2)) * weight)
    if max(p.dt for p in pieces) > (1.0 + 1e-6) * min(p.dt for p in pieces):
        raise FlightError(
            f"the flights have different rates (steps of {sorted({round(p.dt, 9) for p in pieces})} s).",
            hint="Condition all of them to the same rate.",
        )
    judgement = judge(model, pieces, shared, band=band) if judged else None
    return verified(
        model,
        shared,
        traces,
        owners=owners,
        inputs=model.inputs,
        units=model.units,
        warnings=warnings,
        data=data,
        settings={"shifts": shifts, "band_hz": list(band) if band else None},
        judgement=judgement,
        rivals={name: float(np.sqrt(np.mean(np.concatenate(parts) ** 2))) for name, parts in costs.items()},
        constants=constants,
    )


def verified(
    model: StateSpaceModel | Vehicle,
    outputs: tuple[str, ...],
    traces: Sequence[Trace],
    *,
    owners: Sequence[Flight],
    inputs: tuple[str, ...],
    units: Mapping[str, str],
    warnings: Sequence[str],
    data: tuple[DataSource, ...],
    settings: Mapping[str, Any],
    judgement: Judgement | None = None,
    rivals: Mapping[str, float] | None = None,
    constants: int = 0,
) -> Verification:
    """What a model did along records, with its figures.

    Args:
        model: what was flown. outputs: compared. traces: the records. owners: the flight of each trace.
        inputs: of the model. units: of both.
        warnings, data, settings, judgement, rivals, constants: see `Verification`.
    """
    rows, warnings_told = _judged(units, outputs, traces), list(warnings)
    lost = [f"{o.output} ({o.theil:.2f})" for o in rows if o.theil > GOOD_TIC]
    others: dict[str, str] = {}
    if lost or (judgement is not None and judgement.verdict == OPEN):
        errors = {o: [(t.time, t.flight[:, k] - t.model[:, k]) for t in traces] for k, o in enumerate(outputs)}
        others = other_inputs(owners, inputs, errors)
    if lost:
        refuted = judgement is not None and judgement.verdict == REFUTED
        gusts = "What moved them may be no input (gusts)."
        why = "The records refute it." if refuted else " ".join(others.values()) or gusts
        warnings_told.append(
            f"Theil's coefficient above {GOOD_TIC:g}: {', '.join(lost)}. The model does not follow. {why}"
        )
    elif others:
        warnings_told += others.values()
    weight = np.array([_WEIGHT.get(units.get(n, ""), 1.0) for n in outputs])
    errors = np.concatenate([t.flight - t.model for t in traces]) * weight
    cost = float(np.sqrt(np.mean(errors**2)))
    closer = [name for name, other in (rivals or {}).items() if other <= cost]
    if closer:
        warnings_told.append(f"a naive predictor is as close as the model: {', '.join(closer)}.")
    return Verification(
        model=model,
        cost=cost,
        outputs=rows,
        traces=tuple(traces),
        warnings=tuple(warnings_told),
        data=data,
        settings={
            "outputs": list(outputs),
            **settings,
            "stretch_s": max(float(t.time[-1] - t.time[0]) for t in traces),
        },
        judgement=judgement,
        rivals=dict(rivals or {}),
        constants=constants,
        samples=sum(t.flight.size for t in traces),
        floors=_beside(outputs, traces, banded=bool(settings.get("band_hz"))),
        inputs=inputs,
        units=dict(units),
    )


def _beside(outputs: tuple[str, ...], traces: Sequence[Trace], *, banded: bool) -> tuple[Floor, ...]:
    """What the fits stand beside; "hold" is the mean of each stretch, and what moves is the flight about it."""
    times = [t.time for t in traces]
    movement = [(t.flight - t.flight.mean(axis=0)) ** 2 for t in traces]
    box = (
        Ceiling(CROSSED, refused="a band's filters, which have no phase, look ahead")
        if banded
        else ceiling_along(times, [t.inputs for t in traces], [t.flight for t in traces])
    )
    squares = {"model": [(t.flight - t.model) ** 2 for t in traces], HOLD: movement}
    return floors(
        outputs,
        float("inf"),
        times,
        squares,
        dict.fromkeys(squares, movement),
        expected=np.full(len(outputs), np.nan),
        ceilings=[box],
    )


def _along_records(
    model: StateSpaceModel, outputs: tuple[str, ...], name: str, time: Array, table: Array, dt: float, shifts: bool
) -> tuple[Trace, Array, int]:
    """One stretch; what the constants alone leave of the flight (n, n_outputs); how many there are."""
    m, n, k = len(model.inputs), len(model.states), len(outputs)
    inputs, measured = table[:, :m], table[:, m:]
    forced, basis = answers(model, outputs, inputs - inputs.mean(axis=0), dt)
    answer = forced.sum(axis=2)
    if not shifts:
        basis = np.delete(basis, np.s_[n : 2 * n], axis=2)
    weight = np.array([_WEIGHT.get(model.units.get(o, ""), 1.0) for o in outputs])
    flat = (basis * weight[None, :, None]).reshape(time.size * k, -1)
    size = np.maximum(np.linalg.norm(flat, axis=0), 1e-300)
    wanted = np.stack([(values * weight).ravel() for values in (measured - answer, measured)], axis=1)
    scaled, _, rank, _ = np.linalg.lstsq(flat / size, wanted, rcond=1e-8)
    solved, still = (scaled / size[:, None]).T
    trace = Trace(
        source=name,
        time=time,
        flight=measured,
        model=answer + basis @ solved,
        inputs=inputs,
        biases=dict(zip(outputs, map(float, solved[-k:]), strict=True)),
        shifts={f"mode {i + 1}": float(v) for i, v in enumerate(solved[n : 2 * n])} if shifts else {},
    )
    return trace, measured - basis @ still, int(rank)


def _judged(
    units: Mapping[str, str], outputs: tuple[str, ...], traces: Sequence[Trace]
) -> tuple[OutputVerification, ...]:
    outputs_judged = []
    for k, name in enumerate(outputs):
        # Deviations from each stretch's own mean: a bias that was solved for is no merit.
        y = np.concatenate([t.flight[:, k] - t.flight[:, k].mean() for t in traces])
        model_y = np.concatenate([t.model[:, k] - t.flight[:, k].mean() for t in traces])
        error, flight, of_model = (float(np.sqrt(np.mean(np.square(v)))) for v in (y - model_y, y, model_y))
        outputs_judged.append(
            OutputVerification(
                name,
                units.get(name, ""),
                error,
                error / max(flight + of_model, 1e-300),
                100.0 * (1.0 - error / max(flight, 1e-300)),
            )
        )
    return tuple(outputs_judged)
