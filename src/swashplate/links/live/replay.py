"""A logged flight as moments to look at, with a model's prediction beside it that starts anew every few seconds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from swashplate.arrays import Array
from swashplate.engine.equations import SURROUNDINGS
from swashplate.errors import DivergenceError, FlightError, SwashError
from swashplate.flights.flight import Flight
from swashplate.identification.core.records import CALIBRATION, SHORTEST_CALIBRATION, records
from swashplate.identification.time.calibration import calibrate
from swashplate.identification.time.kinematics import PREDICTED, measured_states
from swashplate.links.live.picture import inputs_of, picture, pose_of
from swashplate.models.catalogue import from_card
from swashplate.models.catalogue import vehicle as named_vehicle
from swashplate.models.surroundings import environment_of, input_delays
from swashplate.models.usual import HELICOPTER, USUAL
from swashplate.models.vehicle import Vehicle
from swashplate.registry import listed
from swashplate.simulation.integrate import simulate_open_loop
from swashplate.simulation.trim import trim
from swashplate.validation.prediction import ObservedRecord
from swashplate.validation.validate import observer_of

RATE = 50.0
"""Moments per second [Hz]."""
MOST = 30_000
"""Moments that a page gets; longer flights get fewer per second."""


@dataclass(frozen=True)
class Replay:
    """A flight and a prediction of it at one rate.

    Attributes:
        vehicle: whose shape is drawn.
        title: what is replayed, in words.
        time: [s], shape (n,).
        states: rows in the order of the vehicle's states, shape (n, n_states); what the log does not tell is as at
            hover.
        inputs: shape (n, n_inputs).
        predicted: body states (n, 12) of the model, NaN where there is no prediction; None without a model.
        ahead: seconds after which a prediction starts anew.
        simulated: whether no aircraft flew.
        drawn: the same of drawn models, shape (models, n, 12), NaN where there is none; None where none were asked for.
        begun: when the prediction that is shown began [s], shape (n,), NaN where there is none.
        notes: what the log does not have and what stands in for it, in sentences.
    """

    vehicle: Vehicle
    title: str
    time: Array
    states: Array
    inputs: Array
    predicted: Array | None
    ahead: float
    simulated: bool
    notes: tuple[str, ...] = ()
    drawn: Array | None = None
    begun: Array | None = None


def drawn_as(flight: Flight, model: Vehicle | None) -> Vehicle:
    """The vehicle that a flight is drawn as: the model, otherwise the packaged one that the log names or fits.

    Raises:
        FlightError: where neither is known.
    """
    if model is not None:
        return model
    for name in (flight.provenance.vehicle, USUAL, HELICOPTER):
        try:
            packaged = named_vehicle(name)
        except SwashError:
            continue
        if all(entry in flight for entry in packaged.input_names):
            return packaged
    raise FlightError(
        f"names no vehicle that is known, and its inputs fit none: {', '.join(flight.channels)}.",
        where=flight.provenance.source,
        hint="Say what flies: swash live MODEL --replay LOG.",
    )


def replay(
    flight: Flight,
    *,
    model: Vehicle | None = None,
    draws: Sequence[Vehicle] = (),
    ahead: float = 2.0,
    hold_missing: bool = False,
) -> Replay:
    """What is shown of a conditioned flight.

    Args:
        flight: at one rate, see `Flight.condition`.
        model: predicts the flight from its own inputs; None for no prediction.
        draws: models that a fit cannot tell from this one (`fit.draw(8, seed=1)`), predicted from the same moments.
        ahead: how long each prediction runs [s]; then the next one starts from what an observer knew by then.
        hold_missing: hold inputs of the model that the log lacks at the hover's, and say so in `Replay.notes`.

    Raises:
        FlightError: where a channel of the motion is missing, or an input of the model without `hold_missing`, or the
            flight is too short to be predicted.
    """
    if not ahead > 0.0:
        raise SwashError(f"is {ahead:g} s, expected more than zero.", channel="--ahead")
    if draws and model is None:
        raise SwashError("are of no model: none was given.", channel="draws")
    missing = [name for name in PREDICTED if name not in flight]
    if missing:
        raise FlightError(
            f"lacks {', '.join(missing)}.",
            where=flight.provenance.source,
            hint="A replay draws place, velocity, attitude and rates: give a log that has place and attitude at least. "
            f"It has {listed(flight.channels)}.",
        )
    notes: list[str] = []
    if model is not None:
        flight, notes = _driven(flight, model, hold_missing=hold_missing)
    vehicle = drawn_as(flight, model)
    if model is not None and model.traits.linear:
        vehicle = model = _about_the_flight(model, flight)
        draws = [_about_the_flight(one, flight) for one in draws]
    rate = flight.rate("phi")
    stride = max(1, round(rate / RATE), int(np.ceil(flight.time("phi").size / MOST)))
    body, time = flight.array(PREDICTED)[::stride], flight.time("phi")[::stride]
    hover = trim(vehicle)
    states = np.tile(hover.state, (time.size, 1))
    states[:, : len(PREDICTED)] = body
    unknown = [name for name in vehicle.state_names[len(PREDICTED) :] if name not in flight]
    for i, name in enumerate(vehicle.state_names[len(PREDICTED) :], start=len(PREDICTED)):
        if name in flight:
            states[:, i] = np.interp(time, flight.time(name), flight.values(name))
    inputs = np.stack([np.interp(time, flight.time(n), flight.values(n)) for n in vehicle.input_names], axis=1)
    predicted, begun = None, None
    if model is not None and model.traits.observed:
        predicted, begun = _predicted(flight, (model, *draws), ahead, time)
    elif model is not None:
        around = {n: np.interp(time, flight.time(n), flight.values(n)) for n in SURROUNDINGS if n in flight}
        runs = [_simulated(one, time, states, inputs, around, ahead) for one in (model, *draws)]
        predicted, begun = np.array([rows for rows, _ in runs]), runs[0][1]
        if unknown:
            notes.append(f"The log has no {', '.join(unknown)}: every prediction starts with them as at hover.")
    if unknown and (model is None or model.traits.observed):
        notes.append(f"The log has no {', '.join(unknown)}: they are drawn as at hover.")
    return Replay(
        vehicle,
        flight.provenance.source or "flight",
        time,
        states,
        inputs,
        None if predicted is None else predicted[0],
        ahead,
        flight.provenance.simulated,
        tuple(notes),
        drawn=None if predicted is None or not draws else predicted[1:],
        begun=begun,
    )


def _driven(flight: Flight, model: Vehicle, *, hold_missing: bool) -> tuple[Flight, list[str]]:
    """A flight that has every input of the model, and sentences about what was not logged.

    Raises:
        FlightError: where it lacks one and `hold_missing` was not asked for.
    """
    notes = []
    nominal = model.card.values().get("voltage_nominal")
    if nominal is not None and "voltage" not in flight:
        notes.append(f"The log has no battery voltage: the prediction takes {nominal:g} V, the card's nominal.")
    missing = [name for name in model.input_names if name not in flight]
    if not missing:
        return flight, notes
    if not hold_missing:
        raise FlightError(
            f"lacks {', '.join(missing)}: {model.card.where or model.card.title} is driven by them, and without them "
            "there is no prediction.",
            where=flight.provenance.source,
            hint="Map its columns to these names (--mapping), give a model of its channels, leave the model out, "
            f"or hold what is missing at the hover's with --hold-missing. It has {listed(flight.channels)}.",
        )
    hover = trim(model, voltage=nominal)
    held = {name: float(hover.inputs[model.input_names.index(name)]) for name in missing}
    for name, value in held.items():
        flight = flight.with_channel(name, np.full(flight.time("phi").size, value), like="phi")
    values = ", ".join(f"{name} at {value:.4g}" for name, value in held.items())
    notes.append(
        f"The log has no {', '.join(missing)}. They are held ({values}, as at hover) because that was asked for: the "
        "prediction knows nothing of what was done with them, and is none of this flight."
    )
    return flight, notes


def _about_the_flight(model: Vehicle, flight: Flight) -> Vehicle:
    """A linear model whose deviations count from the flight's mean roll, pitch and inputs: a log has absolute ones.

    What a linear model itself flew is in deviations already.
    """
    if flight.provenance.vehicle == model.name:
        return model
    means = {f"trim_{name}": float(np.mean(flight.values(name))) for name in ("phi", "theta", *model.input_names)}
    card = model.card.with_values(means, source="derived: mean of the flight", status="derived")
    middle = [means[f"trim_{name}"] for name in model.input_names]
    ranges = {
        end: [value + shift for value, shift in zip(card.options[end], middle, strict=True)] for end in ("low", "high")
    }
    return from_card(replace(card, options={**card.options, **ranges}))


def _predicted(flight: Flight, models: Sequence[Vehicle], ahead: float, time: Array) -> tuple[Array, Array]:
    """The models' body states (models, n, 12) at the shown times, and when each prediction began (n,); NaN before the
    first start and between pieces. Delays, trims and lever arm are what the log tells the first."""
    model = models[0]
    noise, prior = observer_of(model)
    states, begun = np.full((len(models), time.size, len(PREDICTED)), np.nan), np.full(time.size, np.nan)
    longest = 0.0
    for piece in records(flight, model):
        length = float(piece.time[-1] - piece.time[0])
        longest = max(longest, length)
        settling = max(SHORTEST_CALIBRATION, min(CALIBRATION, 0.25 * length))
        if length < settling + 1.0:
            continue
        nuisance = calibrate(model, piece, noise=noise, prior=prior, seconds=settling)
        inside = (time >= piece.time[0]) & (time <= piece.time[-1])
        nearest = np.clip(np.searchsorted(piece.time, time[inside] - 1e-6), 0, piece.time.size - 1)
        # The prediction is of the centre of gravity; the log shows the tracked point.
        carried = flight_at(flight, piece.time) - measured_states(piece, nuisance)
        for one, body in zip(models, states, strict=True):
            runs = ObservedRecord(one, piece, noise=noise, nuisance=nuisance).predict(
                horizon=ahead, every=ahead, settling=settling
            )
            rows = np.full((piece.time.size, len(PREDICTED)), np.nan)
            start = runs.starts[0]
            chain = runs.states.reshape(-1, len(PREDICTED))[: piece.time.size - start - 1]
            rows[start + 1 : start + 1 + len(chain)] = chain
            body[inside] = (rows + carried)[nearest]
        place = np.searchsorted(runs.starts, nearest) - 1  # a start itself belongs to the prediction before it
        begun[inside] = np.where(place >= 0, piece.time[runs.starts[place]], np.nan)
    if not np.any(np.isfinite(states)):
        raise FlightError(
            f"the longest unbroken piece has {longest:.1f} s, expected at least {SHORTEST_CALIBRATION + 1:g} s for a "
            "prediction.",
            where=flight.provenance.source,
        )
    return states, begun


def _simulated(
    model: Vehicle, time: Array, states: Array, inputs: Array, around: Mapping[str, Array], ahead: float
) -> tuple[Array, Array]:
    """The model from the logged state on, anew every `ahead` seconds, on the logged inputs, voltage and wind; and when
    each prediction began.

    For vehicles that the observer of the validation is not made for; delays and trims of the log are not looked for. A
    linear model's own delays are flown.
    """
    delays = input_delays(model)
    waits = (delays.get(name, 0.0) for name in model.input_names)
    inputs = np.stack([np.interp(time - d, time, u) for d, u in zip(waits, inputs.T, strict=True)], axis=1)
    step = float(np.median(np.diff(time)))
    length, predicted = max(2, round(ahead / step)), np.full((time.size, len(PREDICTED)), np.nan)
    begun = np.full(time.size, np.nan)
    for first in range(0, time.size - length, length):
        part = slice(first, first + length + 1)
        if time[first + length] - time[first] > (length + 0.5) * step:
            continue  # a gap in the log
        try:
            flight = simulate_open_loop(
                model,
                {n: u[part] for n, u in (*zip(model.input_names, inputs.T, strict=True), *around.items())},
                start=dict(zip(model.state_names, states[first].tolist(), strict=True)),
                rate=1.0 / step,
                delays=0.0,
                substeps=max(1, round(500.0 * step)),
            )
        except DivergenceError:
            continue  # where the model leaves what it is good for, nothing is shown
        predicted[first + 1 : first + length + 1] = flight.array(PREDICTED)[1:]
        begun[first + 1 : first + length + 1] = time[first]
    return predicted, begun


def flight_at(flight: Flight, time: Array) -> Array:
    """The logged body states at some times, shape (n, 12)."""
    stamps, logged = flight.time("phi"), flight.array(PREDICTED)
    return np.stack([np.interp(time, stamps, column) for column in logged.T], axis=1)


def floor(shown: Replay) -> float:
    """How far down the ground is drawn [m]: at the origin, or under the skids where the flight goes lower."""
    return max(0.0, float(np.max(shown.states[:, 2])) + float(picture(shown.vehicle)["skids"]["depth"]))


def as_json(shown: Replay) -> dict[str, Any]:
    """What the page draws: shapes, and per moment body state, inputs, discs and the predicted body state."""
    vehicle = shown.vehicle
    pose, around = pose_of(vehicle), environment_of(vehicle)
    moments = []
    for k, (x, u) in enumerate(zip(shown.states, shown.inputs, strict=True)):
        parts = pose(x, u, around)
        ghost = None
        if shown.predicted is not None and np.all(np.isfinite(shown.predicted[k])):
            ghost = _short(shown.predicted[k])
        fan = None if shown.drawn is None or ghost is None else [_or_none(rows[k]) for rows in shown.drawn]
        moments.append([_short(x[: len(PREDICTED)]), _short(u), *(_nested(parts[key]) for key in PARTS), ghost, fan])
    return {
        "title": shown.title,
        "vehicle": vehicle.card.title,
        "simulated": shown.simulated,
        "ahead": shown.ahead if shown.predicted is not None else None,
        "picture": {**picture(vehicle), "floor": floor(shown)},
        "inputs": inputs_of(vehicle),
        "notes": list(shown.notes),
        "drawn": 0 if shown.drawn is None else len(shown.drawn),
        "begun": None if shown.begun is None else _short(np.nan_to_num(shown.begun, nan=-1.0)),
        "time": _short(shown.time - shown.time[0]),
        "moments": moments,
    }


PARTS = ("rotors", "bar", "tail")


def _short(row: Array) -> list[float]:
    return [float(f"{value:.6g}") for value in np.nan_to_num(row)]


def _or_none(row: Array) -> list[float] | None:
    return _short(row) if np.all(np.isfinite(row)) else None


def _nested(part: Any) -> Any:
    if part is None:
        return None
    return [_short(np.array(inner)) if isinstance(inner, list) else float(f"{inner:.6g}") for inner in part]
