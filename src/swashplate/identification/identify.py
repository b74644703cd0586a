"""`identify`: from flights to an identified vehicle, with everything that a reader needs to trust it or not."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from swashplate.errors import IdentificationError
from swashplate.flights.flight import Array, Flight
from swashplate.identification import accuracy, feedback, nelder_mead
from swashplate.identification.estimates import Found, estimates_of, found_at, record_estimates
from swashplate.identification.fit import APART, AxisExcitation, Comparison, Estimate, Fit
from swashplate.identification.kinematics import PREDICTED, measured_states
from swashplate.identification.output_error import OutputError
from swashplate.identification.parameters import FROM_CARD, Free, Parameterization, parameterize
from swashplate.identification.prediction_error import PredictionError, in_wind
from swashplate.identification.records import POSE, Record, records
from swashplate.identification.stochastic import Noise, Nuisance
from swashplate.identification.valleys import minimise_over_valleys
from swashplate.simulation.compilation import enable_compilation_cache
from swashplate.simulation.dynamics import enable_double_precision
from swashplate.vehicles.card import Card
from swashplate.vehicles.vehicle import Vehicle

METHODS = ("prediction-error", "output-error", "nelder-mead")


def identify(
    vehicle: Vehicle,
    flights: Flight | Sequence[Flight],
    *,
    free: str | Sequence[str | Free] = "full",
    method: str = "prediction-error",
    ties: Sequence[str] = (),
    fixed: Mapping[str, float] | None = None,
    priors: Mapping[str, tuple[float, float]] | None = None,
    prior_card: Card | None = None,
    outputs: Sequence[str] = POSE,
    iterations: int = 60,
    keep_unexcited: bool = False,
    wind: bool = False,
    progress: Callable[[int, float], None] | None = None,
) -> Fit:
    """Identify a vehicle's parameters from one or more conditioned flights.

    Args:
        vehicle: the equations and the card to start from.
        flights: conditioned flights; each unbroken piece is a record with its own delays, trims and lever arm.
        free: "full", "flight" (the paper's six) or names.
        method: "prediction-error" (flights in disturbed air or under feedback), "output-error" (undisturbed open-loop
            flights and simulations) or "nelder-mead" (the paper's own way, for comparison).
        ties: "name = expression" each.
        fixed: values of parameters that are not to move.
        priors: mean and standard deviation by name.
        prior_card: a card from the bench or from another flight: see `parameterize`.
        outputs: measured channels.
        iterations: at most this many.
        keep_unexcited: True also frees parameters of axes that the flights do not move independently.
        wind: True estimates a horizontal wind that acts through the equations (prediction error only): for flights
            outdoors or in strong gusts.
        progress: called with the iteration's number and cost.

    Returns:
        The fit; `fit.failed` tells whether its numbers may be used.

    Raises:
        IdentificationError: where no fit can be started: unknown names, parameters that leave no trace, divergence.
        FlightError: where a flight lacks a channel or is not on a uniform grid.
    """
    if method not in METHODS:
        raise IdentificationError(f"method is '{method}', expected one of {', '.join(METHODS)}.")
    enable_double_precision()
    enable_compilation_cache()
    started = time.perf_counter()
    flights = (flights,) if isinstance(flights, Flight) else tuple(flights)
    table = parameterize(vehicle, free, ties=ties, fixed=fixed, priors=priors, prior_card=prior_card)
    pieces = _long_enough(records(flights, vehicle, outputs=outputs))
    axes = tuple(
        axis for piece in pieces for axis in feedback.excitation(vehicle, piece, measured_states(piece, Nuisance()))
    )
    notes: list[str] = []
    if method == "prediction-error" and not keep_unexcited:
        table, notes = _hold_unexcited(table, axes)
    if wind and method != "prediction-error":
        raise IdentificationError(
            f"a wind was asked for, and method is '{method}'.",
            hint="Only prediction error estimates a wind: leave --wind away, or use --method prediction-error.",
        )
    likelihood = (
        PredictionError(table, pieces, noise=in_wind(pieces) if wind else None)
        if method == "prediction-error"
        else OutputError(table, pieces)
    )
    where = ", ".join(piece.name for piece in pieces)
    likelihood.refresh(likelihood.row.starts())
    accuracy.refuse_unseen(likelihood.row, likelihood.scores(likelihood.row.starts())[2], where=where)
    if method == "nelder-mead":
        assert isinstance(likelihood, OutputError)
        optimum = nelder_mead.minimise_squares(likelihood, progress=progress)
    else:
        shots = method == "output-error"
        optimum = minimise_over_valleys(likelihood, iterations=iterations, together=shots, progress=progress)
    found = found_at(table, likelihood, optimum)
    parameters, problems = estimates_of(found, vehicle)
    notes += [
        f"{e.name}: the flight is {e.disagreement:+.1f} sigmas from the prior card"
        for e in parameters
        if e.prior_source.startswith(FROM_CARD) and abs(e.disagreement) > APART
    ]
    identified = _identified(found, vehicle, parameters, pieces, method)
    return Fit(
        vehicle=identified,
        published=vehicle,
        method=method,
        choice=free if isinstance(free, str) else "given",
        parameters=parameters,
        record_estimates=record_estimates(found),
        noise=_noise(found),
        nuisance=_mean_nuisance(found),
        names=table.names,
        covariance=found.scaled(found.plain),
        covariance_corrected=found.scaled(found.corrected),
        correlation=_correlation(found.scaled(found.plain)),
        directions=accuracy.blind_directions(
            table.names, accuracy.marginal_information(optimum.information, found.prior, found.places)
        ),
        excitation=axes,
        history=optimum.history,
        converged=optimum.converged,
        problems=(*problems, *notes, *(() if optimum.converged else ("the iterations ran out",))),
        failed=bool(problems),
        comparisons=_comparisons(found, pieces),
        flights=flights,
        seconds=time.perf_counter() - started,
        settings={
            "method": method,
            "free": list(table.names),
            "ties": [f"{name} = {expression.text}" for name, expression in table.ties],
            "held at the prior card": list(table.held),
            "outputs": list(outputs),
            "wind": wind,
            "rate": 1.0 / pieces[0].dt,
            "records": [piece.name for piece in pieces],
            "voltage": "logged" if all(piece.voltage_known for piece in pieces) else "not logged: card's nominal",
        },
    )


SHORTEST = 6.0
"""Seconds below which a piece is left out: the filter settles in a quarter of that."""


def _long_enough(pieces: list[Record]) -> list[Record]:
    kept = [piece for piece in pieces if piece.time[-1] - piece.time[0] >= SHORTEST]
    if not kept:
        longest = max(piece.time[-1] - piece.time[0] for piece in pieces)
        raise IdentificationError(
            f"the longest unbroken piece has {longest:.1f} s, expected at least {SHORTEST:g} s.",
            where=pieces[0].name,
            hint="Bridge longer gaps with a larger max_gap, or fly longer.",
        )
    return kept


def _hold_unexcited(table: Parameterization, axes: Sequence[AxisExcitation]) -> tuple[Parameterization, list[str]]:
    """Fix what only unexcited axes could tell, at its prior where it has one."""
    notes = []
    for axis in feedback.AXES:
        judged = [item for item in axes if item.axis == axis.name]
        held = [item for item in table.free if item.name in axis.parameters]
        if not held or any(item.identifiable for item in judged):
            continue
        at = {item.name: item.start if item.mean is None else item.mean for item in held}
        table = replace(
            table.without(at), vehicle=table.vehicle.with_values({k: v for k, v in at.items() if v is not None})
        )
        notes.append(f"{', '.join(at)} held: {judged[0].words}")
    return table, notes


def _noise(found: Found) -> Noise | None:
    if not isinstance(found.likelihood, PredictionError):
        return None
    return Noise(*(float(value) for value in found.likelihood.unpack(found.optimum.row)[2]))


def _mean_nuisance(found: Found) -> Nuisance:
    """Delays and lever arms averaged over the records; trims belong to their flight and are left at zero."""
    likelihood = found.likelihood
    if isinstance(likelihood, PredictionError):
        nuisances = likelihood.unpack(found.optimum.row)[1]
    else:
        nuisances = likelihood.unpack(found.optimum.row[: len(likelihood.row) - likelihood.row.places("initial").size])[
            1
        ]
    means = {name: float(np.mean(np.asarray(value))) for name, value in nuisances._asdict().items()}
    return Nuisance(**{name: 0.0 if name.startswith("trim") else value for name, value in means.items()})


def _correlation(covariance: Array) -> Array:
    d = np.sqrt(np.maximum(np.diag(covariance), 1e-300))
    return np.asarray(covariance / np.outer(d, d))


def _identified(
    found: Found, vehicle: Vehicle, estimates: Sequence[Estimate], pieces: Sequence[Record], method: str
) -> Vehicle:
    """The identified vehicle: the card with the new numbers, where they come from, and what the observer needs."""
    sources = ", ".join(piece.name for piece in pieces)
    card = found.table.vehicle.card
    for estimate in estimates:
        card = card.with_values(
            {estimate.name: estimate.value},
            status="identified",
            sigma=estimate.sigma_corrected,
            source=f"identified by {method} from {sources}",
        )
    changed = {
        name: parameter.value
        for name, parameter in card.parameters.items()
        if parameter.status != "identified"
        and name not in found.table.held
        and parameter.value != vehicle.card.parameters[name].value
    }
    card = card.with_values(changed, status="assumed", source="held during the identification")
    started = vehicle.card.parameters
    moved = {name for name, entry in card.parameters.items() if entry.value != started[name].value}
    card = replace(
        card,
        parameters={
            name: replace(entry, before=started[name].value if name in moved else None)
            for name, entry in card.parameters.items()
        },
    )
    noise, nuisance = _noise(found), _mean_nuisance(found)
    observer = {"nuisance": {k: float(v) for k, v in nuisance._asdict().items()}}
    if noise is not None:
        observer["noise"] = {k: float(v) for k, v in noise._asdict().items()}
    card = replace(card, title=f"{vehicle.card.title}, identified from {sources}", observer=observer, path="")
    return found.table.vehicle.with_card(card)


def _comparisons(found: Found, pieces: Sequence[Record]) -> tuple[Comparison, ...]:
    likelihood, row = found.likelihood, found.optimum.row
    vehicle = found.table.vehicle
    kept = [vehicle.index(name) for name in PREDICTED]
    if isinstance(likelihood, PredictionError):
        innovations, covariances, states = likelihood.innovations(row)
        made = []
        for number, piece in enumerate(pieces):
            n = piece.time.size
            made.append(
                Comparison(
                    record=piece,
                    counted=likelihood.counted[number][:n],
                    model=piece.outputs - likelihood.unturned(np.asarray(innovations)[number][:n], piece),
                    sigma=np.sqrt(np.diag(np.asarray(covariances)[number])),
                    states=np.asarray(states.x)[number][:n][:, kept],
                )
            )
        return tuple(made)
    residual, simulated = (np.asarray(item) for item in likelihood.residuals(row))
    made = []
    for number, piece in enumerate(pieces):
        model, counted = np.full_like(piece.outputs, np.nan), np.zeros(piece.time.size, dtype=bool)
        body = np.full((piece.time.size, len(PREDICTED)), np.nan)
        for place, (owner, first) in enumerate(likelihood.places()):
            if owner == number:
                here = slice(first, first + likelihood.length)
                model[here] = piece.outputs[here] - residual[place]
                body[here] = simulated[place][:, kept]
                counted[here] = True
        sigma = np.sqrt(np.diag(likelihood.covariance))
        made.append(Comparison(record=piece, counted=counted, model=model, sigma=sigma, states=body))
    return tuple(made)
