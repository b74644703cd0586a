"""Simulated sweeps with a known truth, and how far their estimates end from it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from one_step import one_step
from scipy.signal import lfilter

import swashplate as sp
from swashplate.arrays import Array
from swashplate.flights.flight import Flight
from swashplate.identification.core.parameters import parameterize
from swashplate.identification.core.records import records
from swashplate.identification.time.filter_error import in_wind
from swashplate.identification.time.following_error import FollowingError
from swashplate.identification.time.identify import SHORTEST
from swashplate.models.vehicle import Vehicle
from swashplate.simulation.sensors import MotionCapture
from swashplate.simulation.trim import Trim

Hold = Callable[[Vehicle, Trim], Any]

MANEUVER = "sweep:pitch,0.5-8Hz,34s"
"""The band that Fankhauser et al. flew; 40 s with the hover before and after it."""

SAMPLES = 4001
"""At 100 Hz, with 3 s of hover before and after."""

OFF = {
    "a_alpha_v": 0.02,
    "a_alpha_u": 0.004,
    "a_alpha_p": 0.008,
    "tau_f_upper": 1.2,
    "o_zeta_upper": -0.1,
    "o_zeta_lower": 0.05,
}
"""Where the search starts: the six flight parameters, off by a quarter to a half."""


def truth() -> Vehicle:
    return sp.vehicle("coax")


def flown() -> Flight:
    """The maneuver in calm air under a hold of height and heading, every state known."""
    return sp.simulate(truth(), MANEUVER, controller=sp.hover_hold)


def flown_in_gusts(
    seed: int, *, sigma: float, fade: float = 1.0, rate: float = 100.0, controller: Hold = sp.hover_hold
) -> Flight:
    """The same in horizontal gusts: Ornstein-Uhlenbeck, standard deviation `sigma` [m/s], fading in `fade` [s].

    `hover_hold` is fed with true states, and holds roll and pitch weakly with its servos.
    """
    random = np.random.default_rng(seed)
    keep = np.exp(-1.0 / (rate * fade))
    steps = sigma * np.sqrt(1.0 - keep**2) * random.standard_normal((2, SAMPLES))
    north, east = (lfilter([1.0], [1.0, -keep], row) for row in steps)
    return sp.simulate(truth(), MANEUVER, controller=controller, wind=(north, east, 0.0), rate=rate)


@dataclass(frozen=True)
class Recovery:
    """One seed's estimates against the truth.

    Attributes:
        names: parameters.
        error: estimate less truth.
        sigma: predicted standard deviation (corrected for coloured residuals).
        noise: numbers of the noise, where they were estimated.
    """

    names: tuple[str, ...]
    error: Array
    sigma: Array
    noise: Mapping[str, float] = field(default_factory=dict)

    @property
    def distance(self) -> Array:
        """Errors in predicted standard deviations."""
        return np.asarray(self.error / self.sigma)


def recover(
    flight: Flight, *, seed: int, method: str = "output-error", wind: bool = False, unbroken: bool = False
) -> Recovery:
    """What one seed of the usual sensors (noise, gaps, outliers, jitter, battery) makes of a flight.

    Args:
        unbroken: gaps short enough to be bridged, and records of one length: what is compiled serves every seed.
    """
    vehicle = truth()
    sensors = sp.Sensors(motion=MotionCapture(gap_length=0.01)) if unbroken else sp.Sensors()
    logged = sp.observe(flight, vehicle, seed=seed, sensors=sensors).condition(rate=100.0, cutoff=0.0)
    if unbroken:
        logged = logged.between(logged.start, logged.start + 39.505)
    fit = sp.identify(vehicle.with_values(OFF), logged, free="flight", method=method, wind=wind)
    free = [estimate for estimate in fit.estimates if not estimate.tie]
    known = vehicle.card.values()
    return Recovery(
        names=tuple(estimate.name for estimate in free),
        error=np.array([estimate.value - known[estimate.name] for estimate in free]),
        sigma=np.array([estimate.sigma_corrected for estimate in free]),
        noise={} if fit.noise is None else {name: float(value) for name, value in fit.noise._asdict().items()},
    )


def step_from_truth(flight: Flight, *, seed: int, noise: Mapping[str, float]) -> Recovery:
    """Where `recover` with a wind would end, to first order (see `one_step`): a tenth of its cost."""
    vehicle = truth()
    logged = sp.observe(flight, vehicle, seed=seed).condition(rate=100.0, cutoff=0.0)
    pieces = [piece for piece in records(logged, vehicle) if piece.time[-1] - piece.time[0] >= SHORTEST]
    table = parameterize(vehicle, "flight")
    found = one_step(FollowingError(table, pieces, noise=in_wind(pieces)), vehicle.card.values(), noise)
    return Recovery(table.names, found.error, found.sigma)
