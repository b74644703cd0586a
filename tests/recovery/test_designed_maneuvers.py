"""The promise of `design_maneuver`: the standard sweep's bounds in half the flight time, by scatter over seeds."""

from __future__ import annotations

import os
from functools import lru_cache

import numpy as np
import pytest
from scipy.signal import lfilter

import proof_page
import swashplate as sp
from swashplate.flights.maneuvers.series import Maneuver
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
    """The standard sweeps of `SECONDS`, and the design of half of that."""
    vehicle, unknown = sp.vehicle(name), UNKNOWN[name]
    long = sp.design_maneuver(vehicle, unknown, limits=LIMITS | {"seconds": SECONDS}, draws=3)
    short = sp.design_maneuver(vehicle, unknown, limits=LIMITS | {"seconds": 0.5 * SECONDS}, draws=3)
    offers = {offer.kind: offer for offer in long.offers}
    return {"sweep": offers["sweep"].pieces, "designed": short.offers[0].pieces}


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
        wind = {"wind_north": north, "wind_east": east}
        hold = sp.hover_hold if vehicle.traits.coaxial else sp.state_hold
        flight = sp.simulate_maneuver(vehicle, piece, controller=hold, wind=wind)
        quiet = sp.observe(flight, vehicle, seed=100 * seed + k, sensors=sp.QUIET)
        logged.append(quiet.condition(rate=100.0, cutoff=0.0))
    return logged


@pytest.mark.proof
@pytest.mark.parametrize("name", list(UNKNOWN))
def test_half_the_time_tells_as_much_as_the_standard_sweep(name: str) -> None:
    unknown, errors = UNKNOWN[name], {}
    for kind, pieces in flights(name).items():
        found = []
        for seed in range(SEEDS):
            vehicle = truth(name, seed)
            fit = sp.identify(sp.vehicle(name), flown(vehicle, pieces, seed), free=list(unknown), keep_unexcited=True)
            values = vehicle.card.parameters
            found.append([fit[n].value / values[n].value - 1.0 for n in unknown])
        errors[kind] = np.array(found)
    size = {kind: np.sqrt(np.mean(found**2, axis=0)) for kind, found in errors.items()}
    # Each root mean square of n seeds is sure to 1 / sqrt(2 n).
    allowed = 1.0 + 2.0 / np.sqrt(SEEDS)
    passed = bool(np.all(size["designed"] <= allowed * size["sweep"]))
    proof_page.leave(
        f"design_{name}",
        {
            "title": f"A designed maneuver in half the time of the standard sweep: {name}, {SEEDS} seeds",
            "text": f"{0.5 * SECONDS:g} s designed for numbers up to 30 % off, against {SECONDS:g} s of sweeps under "
            f"the same limits, in gusts of {GUST} m/s; root mean square of the relative errors.",
            "columns": ["parameter", f"sweeps, {SECONDS:g} s", f"designed, {0.5 * SECONDS:g} s"],
            "rows": [[n, float(s), float(d)] for n, s, d in zip(unknown, size["sweep"], size["designed"], strict=True)],
            "passed": passed,
        },
    )
    assert passed, size
