"""`validate`: predict flights that no fit has seen, beside the published card and predictors without a model."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from swashplate.arrays import Array
from swashplate.errors import FlightError, SwashError
from swashplate.filtering.disturbances import Noise
from swashplate.filtering.nuisance import Nuisance
from swashplate.flights.flight import Flight, as_flights
from swashplate.identification.core.records import CALIBRATION, HORIZONS, SHORTEST_CALIBRATION, Record, records
from swashplate.identification.core.sources import sources_of
from swashplate.identification.time.feedback import AxisExcitation, excitation
from swashplate.identification.time.kinematics import PREDICTED, measured_states
from swashplate.models.vehicle import Vehicle
from swashplate.simulation.record import monitored
from swashplate.validation.bands import FEWEST_DRAWS, BandedRecord, bands, widening
from swashplate.validation.contact import Contact, contact
from swashplate.validation.controller_law import Law, check_closed
from swashplate.validation.floors import ClosedRecord, ScoredRecord, closed_floors, flight_floors, motion_of
from swashplate.validation.prediction import SETTLING, ObservedRecord, Predictions, naive, spread
from swashplate.validation.validation import (
    Example,
    Score,
    Validation,
    check_innovations,
    fit_percent,
    log_likelihood,
    rms,
    theil,
)
from swashplate.validation.verdict import JUDGED_AHEAD, THRESHOLDS, verdict

_JUDGED = ("x", "y", "z", "u", "v", "w", "phi", "theta", "psi", "p", "q", "r")
_T = TypeVar("_T", Noise, Nuisance)
_EXAMPLES = 6
_EXAMPLE = 2.0
"""Longest example [s]."""
_STARTS = 1.0
"""Seconds over which starts are spread at least."""
_EDGE = 0.1
"""Seconds at a record's end whose measured rates have too few samples around them to be a truth."""


@dataclass(frozen=True)
class _Rival:
    observed: ObservedRecord
    predictions: Predictions
    early: Predictions  # from starts within the calibration


def validate(
    vehicle: Vehicle,
    flights: Flight | Iterable[Flight],
    *,
    published: Vehicle,
    fitted: Sequence[Record] = (),
    horizons: Sequence[float] = HORIZONS,
    every: float = 0.1,
    calibration: float = CALIBRATION,
    close_loop: Sequence[str] = (),
    draws: Sequence[Vehicle] = (),
    progress: Callable[[int, float], None] | None = None,
) -> Validation:
    """Predict unseen flights from many start points and judge the result.

    The first `calibration` seconds of each record tell its delays, trims and lever arm (of the model and of the
    published card alike, each by its own equations); no prediction starts before they are over. Hidden states and slow
    disturbances at each start come from a causal observer with the same noise for both.

    Args:
        vehicle: the model; its card's observer section is used where there is one.
        flights: conditioned flights that the fit has not seen.
        published: the card to compare with. Where that is the model itself, it is no rival in the verdict.
        fitted: the records of its fit, for predictors without a model to learn from.
        horizons: seconds ahead.
        every: seconds between starts.
        calibration: seconds at the start of each record.
        close_loop: axes ("yaw", "heave") whose controller, as those seconds tell it, also predicts in the place of the
            recorded command, which answers gusts that no prediction knows.
        draws: models that the fit cannot tell from this one (`fit.draw(39, seed=1)`). Each predicts too; bands of their
            spread, of the start, of the gusts to come and of the sensors' noise are held against the flights. Without
            any the model itself makes the bands, at the horizons of the verdict, as if its numbers were known.
        progress: called with the number of records done and their number.

    Raises:
        FlightError: where no record is long enough for calibration and the shortest horizon.
        SwashError: for a calibration that is too short to tell anything, an axis whose loop cannot be closed, or draws
            that are too few or of another model.
    """
    alone = _same_numbers(vehicle, published)
    noise, prior = observer_of(vehicle)
    trims = vehicle.card.observer.get("trims", {})
    flights = tuple(monitored(flight, vehicle) for flight in as_flights(flights))
    if not calibration >= SHORTEST_CALIBRATION:
        raise SwashError(f"calibration is {calibration:g} s, expected at least {SHORTEST_CALIBRATION:g} s.")
    check_closed(vehicle, close_loop)
    check_draws(vehicle, draws)
    shortest = calibration + _STARTS + min(horizons)
    all_pieces = records(flights, vehicle)
    pieces = [piece for piece in all_pieces if piece.time[-1] - piece.time[0] > shortest]
    if not pieces:
        longest = max(all_pieces, key=lambda piece: float(piece.time[-1] - piece.time[0]))
        raise FlightError(
            f"the longest unbroken piece has {longest.time[-1] - longest.time[0]:.1f} s, expected more than "
            f"{shortest:g} s ({calibration:g} s to calibrate, {_STARTS:g} s of starts and {min(horizons):g} s ahead).",
            where=longest.name,
            hint="Use a longer flight, or a shorter calibration.",
        )
    parts: dict[tuple[str, float], list[tuple[Array, Array, Array]]] = {}
    scored: dict[float, list[ScoredRecord]] = {}
    contacts: list[Contact | None] = []
    judged: list[AxisExcitation] = []
    measured: list[Array] = []
    looped: dict[float, list[ClosedRecord]] = {}
    banded: dict[float, list[BandedRecord]] = {}
    examples: list[Example] = []
    innovated: dict[str, list[tuple[Array, Array]]] = {"model": [], "published card": []}
    calibrated: list[Nuisance] = []
    laws: list[Law] = []
    for number, piece in enumerate(pieces):
        ahead = max(h for h in horizons if h < piece.time[-1] - piece.time[0] - calibration)
        rivals: dict[str, _Rival] = {}
        for name, vehicle_flown in (("model", vehicle), ("published card", published)):
            if rivals and alone:
                rivals[name] = rivals["model"]
                continue
            observed = ObservedRecord(vehicle_flown, piece, noise, prior).calibrated(calibration, trims)
            predictions = observed.predict(
                horizon=ahead,
                every=every,
                settling=calibration,
                early=None if rivals else SETTLING,
                close_loop=() if rivals else close_loop,
            )
            rivals[name] = _Rival(observed, *reversed(predictions.split(round(calibration / piece.dt))))
        model_rival = rivals["model"]
        calibrated.append(model_rival.observed.nuisance)
        laws.extend(model_rival.predictions.laws)
        truth = measured_states(piece, calibrated[-1])
        # The tracked point as it is: that is what a controller saw, whatever the lever arm.
        judged.extend(excitation(vehicle, piece, measured_states(piece, Nuisance())))
        measured.append(truth)
        sigma = model_rival.observed.sigma(round(ahead / piece.dt))
        wider = _wider(piece, model_rival, truth, sigma, every=every, horizon=min(horizons))
        furthest = ahead if draws else min(ahead, JUDGED_AHEAD)
        drawn = [replace(model_rival.observed, vehicle=one) for one in draws]
        fan = spread(
            drawn or [model_rival.observed] * FEWEST_DRAWS,
            predictions=model_rival.predictions,
            truth=truth,
            longest=round(furthest / piece.dt),
            wider=wider,
        )
        for horizon in horizons:
            if horizon <= ahead:
                starts, prediction = _at_horizon(piece, rivals, horizon)
                for name, part in prediction.items():
                    parts.setdefault((name, horizon), []).append(part)
                if model_rival.predictions.closed is not None:
                    predicted = model_rival.predictions.closed[: len(starts), round(horizon / piece.dt) - 1]
                    looped.setdefault(horizon, []).append(
                        ClosedRecord(piece.time[starts], predicted, *prediction["model"])
                    )
                promised = sigma[round(horizon / piece.dt) - 1]
                if horizon <= furthest:
                    banded.setdefault(horizon, []).append(fan.at(horizon, piece, starts))
                scored.setdefault(horizon, []).append(
                    ScoredRecord(piece.name, motion_of(piece, truth, starts), promised)
                )
        shown = fan.sigma if draws else np.broadcast_to(sigma, model_rival.predictions.states.shape)
        examples.extend(_examples(piece, model_rival, shown[:, : round(_EXAMPLE / piece.dt)]))
        settled = round(calibration / piece.dt)
        disturbed = model_rival.predictions.disturbances[settled:]
        contacts.append(contact(piece.name, piece.time[settled:], truth[settled:], disturbed))
        for name, rival in rivals.items():
            innovated[name].append((rival.predictions.innovations[settled:], rival.predictions.covariance))
        if progress is not None:
            progress(number + 1, float(len(pieces)))
    scores, judged_bands = _scores(parts), bands(banded)
    beside = flight_floors(
        scored,
        {k: v for k, v in parts.items() if not (alone and k[0] == "published card")},
        training=[motion_of(one, measured_states(one, prior), np.zeros(0, dtype=np.intp)) for one in fitted],
    )
    return Validation(
        vehicle=vehicle,
        published=published,
        scores=scores,
        innovations=check_innovations(
            np.concatenate([rows for rows, _ in innovated["model"]]),
            np.mean([covariance for _, covariance in innovated["model"]], axis=0),
            pieces[0].output_names,
        ),
        log_likelihood={
            name: float(np.mean([log_likelihood(*one) for one in each])) for name, each in innovated.items()
        },
        verdict=verdict(
            [s for s in scores if not (alone and s.predictor == "published card")], judged, beside, judged_bands
        ),
        thresholds=THRESHOLDS,
        examples=tuple(examples),
        records=tuple(pieces),
        measured=tuple(measured),
        data=sources_of(flights),
        settings={
            "horizons": list(horizons),
            "every": every,
            "calibration": calibration,
            "records": [piece.name for piece in pieces],
            "noise": {k: float(v) for k, v in noise._asdict().items()},
            "draws": len(draws),
        },
        calibrated=tuple(calibrated),
        floors=beside,
        contacts=tuple(one for one in contacts if one is not None),
        without_contact=_scores(_without_contact(parts, scored, contacts)),
        loop_closed=closed_floors(looped),
        laws=tuple(laws),
        bands=judged_bands,
        not_logged=tuple(
            name for name in (*vehicle.rotor_speeds, "voltage") if any(name not in flight for flight in flights)
        ),
    )


def check_draws(vehicle: Vehicle, draws: Sequence[Vehicle]) -> None:
    """That drawn models are as many as the bands need, and of the model's equations.

    Raises:
        SwashError: where not.
    """
    if draws and (len(draws) + 1) % (FEWEST_DRAWS + 1):
        raise SwashError(
            f"are {len(draws)}, expected {FEWEST_DRAWS}, {2 * FEWEST_DRAWS + 1}, {3 * FEWEST_DRAWS + 2} and so on.",
            channel="draws",
            hint="Then a whole number of paths lies outside each band.",
        )
    if any(one.state_names != vehicle.state_names or one.input_names != vehicle.input_names for one in draws):
        raise SwashError("are of another model than the one that is validated.", channel="draws")


def _wider(piece: Record, rival: _Rival, truth: Array, sigma: Array, *, every: float, horizon: float) -> Array:
    """How much wider the bands of a record are to be, by its first seconds (see `widening`)."""
    ahead = round(horizon / piece.dt)
    starts = rival.early.starts[rival.early.starts + ahead < rival.predictions.starts[0]]
    errors = truth[starts + ahead] - rival.early.states[: len(starts), ahead - 1]
    return widening(errors, sigma[ahead - 1], seconds=len(starts) * every, horizon=horizon)


def _without_contact(
    parts: Mapping[tuple[str, float], Sequence[tuple[Array, Array, Array]]],
    scored: Mapping[float, Sequence[ScoredRecord]],
    contacts: Sequence[Contact | None],
) -> dict[tuple[str, float], list[tuple[Array, Array, Array]]]:
    """The model's predictions that no proposed mask touches; nothing where none is proposed."""
    if not any(contacts):
        return {}
    errors: dict[tuple[str, float], list[tuple[Array, Array, Array]]] = {}
    for horizon, records_at in scored.items():
        for record, rows in zip(records_at, parts["model", horizon], strict=True):
            start = record.motion.time[record.motion.starts]
            mask = next((c for c in contacts if c is not None and c.record == record.name), None)
            free = ~mask.touches(start, horizon) if mask else np.ones(start.shape, dtype=bool)
            predicted, truth, first = rows
            errors.setdefault(("model", horizon), []).append((predicted[free], truth[free], first[free]))
    return errors


def _same_numbers(one: Vehicle, other: Vehicle) -> bool:
    return one.card.values() == other.card.values() and dict(one.card.options) == dict(other.card.options)


def observer_of(vehicle: Vehicle) -> tuple[Noise, Nuisance]:
    """Noise and usual nuisances from a model's observer section, or the defaults where the card has none."""
    noise = vehicle.card.observer.get("noise", {})
    nuisance = vehicle.card.observer.get("nuisance", {})
    usual = Nuisance() if nuisance else Nuisance(delay_servo=0.05, delay_motor=0.05)
    return _filled(Noise(), noise), _filled(usual, nuisance)


def _filled(usual: _T, given: Mapping[str, float]) -> _T:
    known = {name: float(value) for name, value in given.items() if name in usual._fields}
    return usual._replace(**known)


def _at_horizon(
    piece: Record, rivals: Mapping[str, _Rival], horizon: float
) -> tuple[NDArray[np.intp], dict[str, tuple[Array, Array, Array]]]:
    """The starts, and the predicted, true and starting states of every predictor at one horizon.

    What was measured is carried to the centre of gravity by each vehicle's own lever arm; without a vehicle, by the
    model's.
    """
    ahead = round(horizon / piece.dt)
    starts = rivals["model"].predictions.starts
    counted = starts + ahead < piece.time.size - round(_EDGE / piece.dt)
    first = starts[counted]
    truths = {name: measured_states(piece, r.observed.nuisance) for name, r in rivals.items()}
    predicted = {
        name: (r.predictions.states[counted, ahead - 1], truths[name][first + ahead], truths[name][first])
        for name, r in rivals.items()
    }
    truth = truths["model"]
    for name, kind in (("hold", "hold"), ("constant rates", "rates")):
        predicted[name] = (naive(truth, first, ahead, piece.dt, kind=kind), truth[first + ahead], truth[first])
    return first, predicted


def _scores(parts: Mapping[tuple[str, float], Sequence[tuple[Array, Array, Array]]]) -> tuple[Score, ...]:
    scores = []
    for (name, horizon), rows in parts.items():
        predicted, truth, first = (np.concatenate(columns) for columns in zip(*rows, strict=True))
        if not len(truth):
            continue
        fits, errors, theils = (
            fit_percent(predicted, truth, first),
            rms(predicted - truth),
            theil(predicted, truth, first),
        )
        for channel in _JUDGED:
            i = PREDICTED.index(channel)
            scores.append(Score(channel, horizon, name, float(fits[i]), float(errors[i]), float(theils[i]), len(truth)))
    return tuple(scores)


def _examples(piece: Record, rival: _Rival, sigma: Array) -> list[Example]:
    """A few predictions spread over the record, as long as their standard deviations (starts, n, 12)."""
    ahead = sigma.shape[1]
    usable = np.flatnonzero(rival.predictions.starts + ahead < piece.time.size)
    chosen = usable[np.linspace(0, usable.size - 1, min(_EXAMPLES, usable.size)).astype(int)] if usable.size else usable
    examples = []
    for place in chosen:
        start = int(rival.predictions.starts[place])
        examples.append(
            Example(
                record=piece.name,
                start=float(piece.time[start]),
                time=piece.time[start + 1 : start + 1 + ahead],
                states=rival.predictions.states[place, :ahead],
                sigma=sigma[place],
            )
        )
    return examples
