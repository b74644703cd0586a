"""What to fly so that a flight tells some parameters best, and what each second buys."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from swashplate.api.asking import strings
from swashplate.api.controllers import from_file
from swashplate.api.designed_maneuver import LEAD, DesignedManeuver
from swashplate.api.saying import Say
from swashplate.api.told_by_maneuvers import DesignDraws, offer_of
from swashplate.arrays import Array
from swashplate.control.laws.hold import hover_hold
from swashplate.control.laws.state_hold import state_hold
from swashplate.errors import ManeuverError
from swashplate.filtering.disturbances import Noise
from swashplate.flights.maneuvers.composed import composed
from swashplate.flights.maneuvers.multisine import dealt
from swashplate.flights.maneuvers.series import AXES, DEFAULT_AMPLITUDE, Maneuver, parse
from swashplate.identification.design.information import best_powers, sensed
from swashplate.models.catalogue import vehicle as find_vehicle
from swashplate.models.vehicle import Vehicle
from swashplate.registry import listed
from swashplate.simulation.controller import Controller
from swashplate.simulation.trim import Trim
from swashplate.validation.validate import observer_of

if TYPE_CHECKING:
    from swashplate.api.verbs.maneuver import DesignManeuver

LIMITS = ("amplitude", "attitude", "rate", "place", "battery", "seconds")
"""What may be limited: deflection [1], attitude from trim [deg], body rates [deg/s], distance [m], a battery's flight
and the maneuver [s]."""
_USUAL: Mapping[str, float] = {"attitude": 20.0, "rate": 120.0, "place": 3.0, "seconds": 30.0}
_PEAK = 1.7
"""Peak over root mean square that phases of least peak are counted on to reach; what they reach is flown."""
_VAGUE = 50.0
"""Percent of a value that a bound may have where a maneuver is called feasible."""
_STEPS = (0.25, 0.5, 1.0, 2.0)


def design_for(asked: DesignManeuver, say: Say) -> DesignedManeuver:
    """The maneuver that was asked for, beside a sweep and a 3-2-1-1 of the same length and limits.

    The powers of a multisine's lines are chosen for the information that they give in the closed loop, by the model's
    exact slopes and the noise that the likelihoods of flights have; its phases for a low peak. Each way to fly is then
    simulated with all nonlinearity and made smaller until it keeps the limits, for every draw of the prior.
    """
    vehicle = find_vehicle(asked.vehicle) if isinstance(asked.vehicle, str | Path) else asked.vehicle
    flies = from_file(asked.controller) if isinstance(asked.controller, str | Path) else asked.controller
    unknown, band, spread, draws, rate = strings(asked.unknown), asked.band, asked.spread, asked.draws, asked.rate
    unknown = tuple(dict.fromkeys(unknown))
    kept = _checked_limits(asked.limits or {})
    if not 0.0 < band[0] < band[1] <= 0.4 * rate:
        raise ManeuverError(
            f"is {band[0]:g} to {band[1]:g} Hz, expected it to rise to at most {0.4 * rate:g} Hz.", channel="band"
        )
    moved = _axes_of(vehicle, None if asked.axes is None else strings(asked.axes))
    seconds, (expected, source) = kept["seconds"], _expected_noise(vehicle, asked.noise)
    if "battery" in kept and seconds + 2.0 * LEAD > kept["battery"]:
        raise ManeuverError(
            f"{seconds:g} s and {2.0 * LEAD:g} s of hover are more than the battery's {kept['battery']:g} s.",
            channel="battery",
            hint=f"Fly at most {max(kept['battery'] - 2.0 * LEAD, 0.0):g} s at a time.",
        )
    lines = dealt(band[0], band[1], seconds, axes=len(moved))
    if min(own.size for own in lines) < 2 or seconds * band[0] < 2.0:
        raise ManeuverError(
            f"{seconds:g} s hold {seconds * band[0]:.1f} periods of {band[0]:g} Hz and "
            f"{min(own.size for own in lines)} lines an axis, expected at least 2 of each.",
            channel="seconds",
            hint=f"Fly at least {max(2.0 / band[0], (2.0 * len(moved) + 1.0) / (band[1] - band[0])):.3g} s, "
            "or in a band that begins at a higher frequency or is wider.",
        )
    peak = _deflections(moved, kept.get("amplitude"))
    say("linearising the draws of the prior")
    models = _draws(vehicle, unknown, spread, draws, asked.seed)
    values = np.array([abs(vehicle.numbers[n].value) or 1.0 for n in unknown])
    known = np.diag(np.append(np.full(len(unknown), max(spread, 0.05) ** -2.0), 1.0))
    seen = [sensed(one, unknown) for one in models]
    told = DesignDraws(models, seen, unknown, expected, rate, flies or usual_hold, values)
    say("probing the closed loop")
    numbers = np.concatenate(lines)
    owner = np.repeat(np.arange(len(moved)), [own.size for own in lines])
    responses = told.probe(moved, lines, seconds, peak)
    frequency = numbers / seconds
    per_power = np.stack(
        [2.0 * seconds * told.scale * told.lines(d, frequency, response) for d, response in enumerate(responses)]
    )
    allowed = np.array([(peak[axis] / _PEAK) ** 2 for axis in moved])
    say("choosing powers")
    power = best_powers(per_power, owner, allowed, known, criterion=asked.criterion, worst=asked.robust == "worst")
    powers = {a: dict(zip(lines[i].tolist(), power[owner == i], strict=True)) for i, a in enumerate(moved)}
    design = composed(powers, duration=seconds, peak=peak)
    table = {axis: (lines[i] / seconds, [r[owner == i] for r in responses]) for i, axis in enumerate(moved)}
    low = max(band[0], 4.001 * len(moved) / seconds)  # a sweep needs four periods
    block = seconds / len(moved) / 7.0
    rivals: list[tuple[str, list[Maneuver]]] = [("multisine", [design])]
    if low < band[1]:
        sweeps = [parse(f"sweep:{a},{low:.6g}-{band[1]:g}Hz,{seconds / len(moved):.6g}s,{peak[a]:g}") for a in moved]
        rivals.append(("sweep", sweeps))
    rivals.append(("3211", [parse(f"3211:{a},{block:.6g}s,{peak[a]:g}") for a in moved]))
    offers, why = [], []
    for kind, pieces in rivals:
        say(f"flying the {kind} in simulation")
        whole = sum(piece.duration for piece in pieces) + 2.0 * LEAD * len(pieces)
        if whole > kept.get("battery", np.inf):
            why.append(f"{kind}: {len(pieces)} pieces with their hovers take {whole:.3g} s, more than the battery's")
            continue
        try:
            offers.append(offer_of(kind, pieces, told, table, kept))
        except ManeuverError as trouble:
            why.append(f"{kind}: {trouble.args[0] if trouble.args else trouble}")
    if not offers:
        raise ManeuverError(f"no maneuver is feasible: {'; '.join(why)}", where=vehicle.name, channel="limits")
    first = offers[0]
    buys = []
    for share in _STEPS:
        total = [share * told.information(d, first.pieces, table) for d in range(len(models))]
        buys.append((share * first.seconds, told.bounds(total)))
    made = DesignedManeuver(
        vehicle,
        unknown,
        tuple(offers),
        tuple(buys),
        kept,
        asked.criterion,
        asked.robust,
        len(models),
        spread,
        rate,
        noise=source,
    )
    _refuse_vague(made, values)
    return made


def _refuse_vague(made: DesignedManeuver, values: Array) -> None:
    percent = {n: 100.0 * made.best.bounds[n] / v for n, v in zip(made.unknown, values, strict=True)}
    vague = {n: p for n, p in percent.items() if not p <= _VAGUE}
    if not vague:
        return
    named = ", ".join(f"{n} {p:.3g} %" if np.isfinite(p) else f"{n} not at all" for n, p in vague.items())
    longest = max(vague.values())
    hint = "Ask for fewer unknowns: some of these move together, or nothing measured shows them."
    if np.isfinite(longest):
        hint = f"It would take {made.best.seconds * (longest / _VAGUE) ** 2:.3g} s, wider limits, or fewer unknowns."
    raise ManeuverError(
        f"no maneuver within the limits tells it: the best leaves {named}, expected at most {_VAGUE:g} %.",
        where=made.vehicle.name,
        channel=", ".join(vague),
        hint=hint,
    )


# ---- checks ----------------------------------------------------------------------------------------------------------
def _checked_limits(limits: Mapping[str, float]) -> dict[str, float]:
    for name, value in limits.items():
        if name not in LIMITS:
            raise ManeuverError("is no limit.", channel=name, hint=f"There are {', '.join(LIMITS)}.")
        if not 0.0 < value < np.inf:
            raise ManeuverError(f"is {value:g}, expected a number above zero: nothing could be flown.", channel=name)
    return {**_USUAL, **limits}


def _deflections(moved: Sequence[str], largest: float | None) -> dict[str, float]:
    """Largest deflection by axis: the usual ones, all larger in proportion, and none above the limit."""
    usual = {axis: DEFAULT_AMPLITUDE.get(axis, 0.1) for axis in moved}
    if largest is None:
        return usual
    share = max(1.0, largest / max(usual.values()))
    return {axis: min(largest, share * one) for axis, one in usual.items()}


def _expected_noise(vehicle: Vehicle, noise: Mapping[str, float] | Noise | None) -> tuple[Noise, str]:
    """Noise to design for, and in words whose it is."""
    if noise is not None:
        return Noise(**noise) if isinstance(noise, Mapping) else noise, "as given"
    learnt = observer_of(vehicle)[0]
    if not vehicle.card.observer.get("noise") or learnt.wind > 0.0:
        return Noise(), "usual indoors"
    return learnt, "of the model's flights"


def _axes_of(vehicle: Vehicle, axes: Sequence[str] | None) -> tuple[str, ...]:
    has = tuple(axis for axis in AXES if axis in vehicle.stick_axes)
    moved = has if axes is None else tuple(dict.fromkeys(axes))
    strange = [axis for axis in moved if axis not in has]
    if strange or not moved:
        raise ManeuverError(
            f"is no axis of '{vehicle.name}'." if strange else f"'{vehicle.name}' has no axes to move.",
            channel=", ".join(strange) or "axes",
            hint=f"It has {listed(has)}." if has else f"None of its inputs is {listed(AXES)}.",
        )
    return moved


def _draws(vehicle: Vehicle, unknown: Sequence[str], spread: float, draws: int, seed: int) -> list[Vehicle]:
    """The vehicle, and others with the unknowns anywhere within the spread and the bounds of physics."""
    random, made, numbers = np.random.default_rng(seed), [vehicle], vehicle.numbers
    absent = [name for name in unknown if name not in numbers]
    if absent:
        sensed(vehicle, absent)  # says what it has
    for _ in range(draws - 1 if spread > 0.0 else 0):
        told = {}
        for name in unknown:
            value = numbers[name].value * (1.0 + spread * random.uniform(-1.0, 1.0))
            low, high = numbers[name].lower, numbers[name].upper
            told[name] = float(np.clip(value, -np.inf if low is None else low, np.inf if high is None else high))
        made.append(vehicle.with_values(told))
    return made


def usual_hold(vehicle: Vehicle, about: Trim) -> Controller:
    """The hold of the kind of vehicle, which flies a design unless another controller is given."""
    return hover_hold(vehicle, about) if vehicle.traits.coaxial else state_hold(vehicle, about)
