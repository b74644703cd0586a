"""What belongs to a new record and not to the vehicle: its delays, trims and lever arm, from its first seconds."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from swashplate.filtering.disturbances import Noise
from swashplate.filtering.nuisance import Nuisance
from swashplate.identification.core.parameters import Parameterization
from swashplate.identification.core.records import Record
from swashplate.identification.core.scoring import minimise
from swashplate.identification.time.prediction_error import PredictionError
from swashplate.models.vehicle import Vehicle
from swashplate.validation.spans import CALIBRATION


def first_part(record: Record, seconds: float) -> Record:
    """The first `seconds` of a record (all of it where it is shorter)."""
    n = min(record.time.size, round(seconds / record.dt) + 1)
    return replace(
        record, time=record.time[:n], inputs=record.inputs[:n], outputs=record.outputs[:n], voltage=record.voltage[:n]
    )


def calibrate(
    vehicle: Vehicle, record: Record, *, noise: Noise, prior: Nuisance, seconds: float = CALIBRATION
) -> Nuisance:
    """Delays, trims and lever arm of a record by maximum likelihood over its first seconds, the vehicle held.

    How late a log's motion is against its commands, where the tracked point lies and how the servos are trimmed differ
    from flight to flight. Nothing of the vehicle is moved, and nothing after `seconds` is seen.

    Args:
        prior: centre of the priors, e.g. what the fit found on its own records.
    """
    likelihood = PredictionError(
        Parameterization(vehicle, ()), [first_part(record, seconds)], noise=noise, estimate_noise=False, nuisance=prior
    )
    found = likelihood.unpack(minimise(likelihood, iterations=30).row)[1]
    return Nuisance(*(float(np.asarray(value).ravel()[0]) for value in found))
