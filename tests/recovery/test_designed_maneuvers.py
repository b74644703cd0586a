"""The promise of `design_maneuver`: the standard sweep's bounds in half the flight time, by scatter over seeds."""

from __future__ import annotations

import os
from functools import lru_cache
from typing import NamedTuple

import numpy as np
import pytest
from one_step import one_step
from scipy.signal import lfilter

import proof_page
import swashplate as sp
from swashplate.arrays import Array
from swashplate.filtering.disturbances import Noise
from swashplate.flights.maneuvers.series import Maneuver
from swashplate.identification.core.parameters import parameterize
from swashplate.identification.core.records import records
from swashplate.identification.time.filter_error import FilterError
from swashplate.models.doubts import monitored
from swashplate.models.vehicle import Vehicle

SEEDS = int(os.environ.get("SWASHPLATE_DESIGN_SEEDS", "100"))
UNKNOWN = {
    "coax": ("tau_f_upper", "linkage_lower", "hub_stiffness_upper"),
    "crazyflie": ("inertia_xx", "tau_drive", "flap_back"),
    "raptor50": ("hub_stiffness", "inertia_xx", "tail_lift_slope"),
}
LIMITS = {"attitude": 20.0, "rate": 120.0, "place": 3.0}
SECONDS = 30.0
GUST = 0.05  # m/s: what an indoor room has


@lru_cache(maxsize=4)
def flights(name: str) -> dict[str, tuple[Maneuver, ...]]:
    """The standard sweeps of `SECONDS`, and the design of half of that, for the noise that an earlier flight showed.

    The earlier flight is sweeps of a vehicle that is not judged. Of its fit the design takes the noise alone.
    """
    vehicle, unknown = sp.vehicle(name), UNKNOWN[name]
    long = sp.design_maneuver(vehicle, unknown, limits=LIMITS | {"seconds": SECONDS}, draws=3)
    sweep = next(offer for offer in long.offers if offer.kind == "sweep").pieces
    earlier = sp.identify(vehicle, flown(truth(name, SEEDS), sweep, SEEDS), free=list(unknown), keep_unexcited=True)
    half = LIMITS | {"seconds": 0.5 * SECONDS}
    short = sp.design_maneuver(vehicle, unknown, limits=half, draws=3, noise=earlier.noise)
    return {"sweep": sweep, "designed": short.offers[0].pieces}


def truth(name: str, seed: int) -> Vehicle:
    """A vehicle whose unknowns are up to 30 % off what the design took."""
    random, vehicle = np.random.default_rng(seed), sp.vehicle(name)
    card = vehicle.card.parameters
    return vehicle.with_values({n: card[n].value * random.uniform(0.7, 1.3) for n in UNKNOWN[name]})


def flown(vehicle: Vehicle, pieces: tuple[Maneuver, ...], seed: int) -> list[sp.Flight]:
    """The pieces in gusts under the usual sensors."""
    random, logged = np.random.default_rng(1000 + seed), []
    for k, piece in enumerate(pieces):
        samples, keep = round((piece.duration + 6.0) * 100.0) + 1, float(np.exp(-0.01))
        steps = GUST * np.sqrt(1.0 - keep**2) * random.standard_normal((2, samples))
        north, east = (lfilter([1.0], [1.0, -keep], row) for row in steps)
        hold = sp.hover_hold if vehicle.traits.coaxial else sp.state_hold
        flight = sp.simulate(vehicle, piece, controller=hold, wind=(north, east, 0.0))
        quiet = sp.observe(flight, vehicle, seed=100 * seed + k, sensors=sp.QUIET)
        logged.append(quiet.condition(rate=100.0, cutoff=0.0))
    return logged


WHOLE = 3
"""Seeds that are fitted as a user does, from a card up to 30 % off; the others take one step from the truth."""


class Errors(NamedTuple):
    """Relative errors (seeds, unknowns): to first order of every seed, and of whole fits of the first few."""

    steps: Array
    fits: Array


def errors(name: str, kind: str) -> Errors:
    """What the estimates of every seed are off by."""
    unknown, pieces, card = list(UNKNOWN[name]), flights(name)[kind], sp.vehicle(name)
    steps, fits, noises = [], [], []
    for seed in range(SEEDS):
        vehicle = truth(name, seed)
        logged, values = flown(vehicle, pieces, seed), vehicle.card.values()
        if seed < WHOLE:
            fit = sp.identify(card, logged, free=unknown, keep_unexcited=True)
            fits.append([fit[n].value / values[n] - 1.0 for n in unknown])
            noises.append([max(float(x), 1e-12) for x in fit.noise])
        noise = dict(zip(Noise._fields, np.exp(np.mean(np.log(noises), axis=0)), strict=True))
        made = records([monitored(one, vehicle) for one in logged], vehicle)
        likelihood = FilterError(parameterize(vehicle, unknown), made, noise=Noise())
        steps.append(one_step(likelihood, values, noise).error / [values[n] for n in unknown])
    return Errors(np.array(steps), np.array(fits))


@pytest.mark.proof
@pytest.mark.parametrize("name", list(UNKNOWN))
def test_half_the_time_tells_as_much_as_the_standard_sweep(name: str) -> None:
    judged(name, {kind: errors(name, kind) for kind in flights(name)})


def judged(name: str, found: dict[str, Errors]) -> None:
    """Leave the table of the estimates' scatter, then hold it against what is promised."""
    count = len(found["sweep"].steps)
    size = {kind: np.sqrt(np.mean(one.steps**2, axis=0)) for kind, one in found.items()}
    whole = {kind: np.sqrt(np.mean(one.fits**2, axis=0)) for kind, one in found.items()}
    apart = {kind: np.abs(one.fits - one.steps[: len(one.fits)]).max(axis=0) for kind, one in found.items()}
    # Each root mean square of n seeds is sure to 1 / sqrt(2 n).
    passed = bool(np.all(size["designed"] <= (1.0 + 2.0 / np.sqrt(count)) * size["sweep"]))
    columns = [[100.0 * float(x) for x in part[kind]] for part in (size, whole, apart) for kind in found]
    proof_page.leave(
        f"design_{name}",
        {
            "title": f"A designed maneuver in half the time of the standard sweep: {name}, {count} seeds",
            "text": f"{0.5 * SECONDS:g} s designed for numbers up to 30 % off, against {SECONDS:g} s of sweeps under "
            f"the same limits, in gusts of {GUST} m/s. The design (criterion D) takes the noise of air and sensors "
            "from a fit of sweeps of another vehicle, which is not judged. Root mean square of the relative errors in "
            "percent, to first order (one Gauss-Newton step from the truth). Beside it whole fits of "
            f"{len(found['sweep'].fits)} seeds from the card, and how far they end from their steps at most, in "
            "percent of the value.",
            "columns": [
                "parameter",
                *(
                    f"{words}, {SECONDS if kind == 'sweep' else 0.5 * SECONDS:g} s {kind}"
                    for words in ("all seeds", "whole fits", "apart")
                    for kind in found
                ),
            ],
            "rows": [[n, *row] for n, *row in zip(UNKNOWN[name], *columns, strict=True)],
            "passed": passed,
        },
    )
    assert passed, size
