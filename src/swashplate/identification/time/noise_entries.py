"""The noise numbers of a fit by filter error: which are estimated, their first guesses and their priors."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from swashplate.filtering.disturbances import GYROSCOPE, SEPARATE, Noise
from swashplate.filtering.disturbed_model import StochasticModel
from swashplate.flights.schema import RATES
from swashplate.identification.core.parameter_row import Entry
from swashplate.identification.core.records import Record
from swashplate.identification.time.start_states import slopes

_SPREAD = {
    "tau_gust_moment": 0.5,
    "tau_gust_force": 0.5,
    "drift_moment": 0.5,
    "drift_force": 0.5,
    **{name: spread for name, (_, _, spread) in SEPARATE.items()},
}
"""Width of the prior on the logarithm of each noise number; the others get 2 (a factor of 7)."""

_WIND = ("wind", "tau_wind")

_ADDED = ("white", "gust", "wind", "sensor")
"""How the noise numbers begin whose squares add to the innovations' variance; drifts and times act by ratios."""


def in_wind(pieces: Sequence[Record]) -> Noise:
    """First guesses of the noise for flights in horizontal wind, with the speed that the records were flown at."""
    return Noise(wind=0.1, speed=_typical_speed(pieces))


def _typical_speed(pieces: Sequence[Record]) -> float:
    """Root mean square of each horizontal velocity [m/s]; zero where no positions were measured."""
    if not {"x", "y"} <= set(pieces[0].output_names):
        return 0.0
    columns = [pieces[0].output_names.index(name) for name in ("x", "y")]
    velocities = [slopes(piece, np.arange(0.0, piece.time.size, 10.0))[1][:, columns] for piece in pieces]
    return float(np.sqrt(np.mean(np.concatenate(velocities) ** 2)))


def with_first_guesses(noise: Noise, separate: Sequence[str], outputs: Sequence[str]) -> Noise:
    """The noise with first guesses of what yaw or heave are to have for themselves, and that of a gyroscope in use."""
    if set(RATES) & set(outputs) and not noise.sensor_rate > 0.0:
        noise = noise._replace(sensor_rate=GYROSCOPE)
    return noise._replace(**{name: SEPARATE[name][1] for name in separate if not getattr(noise, name) > 0.0})


def estimated_noises(model: StochasticModel, guess: Noise) -> tuple[str, ...]:
    """The noise numbers that are estimated: the speed and a gyroscope's noise are given, the wind's and the separate
    ones only where wanted.

    Tracked angles err for tenths of a second on end. To the likelihood such errors look like motion, and it would call
    the gyroscope wrong that does not show them (found on flights of a Crazyflie: 0.17 rad/s instead of 0.04, and delays
    and inertias to go with it).
    """
    left = {"speed", "sensor_rate", *(() if model.windy else _WIND)}
    left |= {name for name in SEPARATE if not getattr(guess, name) > 0.0}
    return tuple(name for name in Noise._fields if name not in left)


def noise_entries(names: Sequence[str], guess: Noise) -> list[Entry]:
    """Row entries of estimated noise numbers: logarithms about their first guesses."""
    return [
        Entry(name, "noise", log, 1.0, log - 9.0, log + 9.0, log, _SPREAD.get(name, 2.0), True, name.startswith(_ADDED))
        for name, log in ((name, float(np.log(getattr(guess, name)))) for name in names)
    ]
