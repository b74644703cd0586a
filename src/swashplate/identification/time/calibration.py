"""What belongs to a new record and not to the vehicle: its delays, trims and lever arm, from its first seconds."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from swashplate.filtering.disturbances import Noise
from swashplate.filtering.nuisance import Nuisance
from swashplate.identification.core.parameters import Parameterization, trim_of_record
from swashplate.identification.core.records import CALIBRATION, Record
from swashplate.identification.core.scoring import Solver, minimise
from swashplate.identification.time.filter_error import FilterError
from swashplate.models.residual import HEADING, facing
from swashplate.models.vehicle import Vehicle


def as_begun(vehicle: Vehicle, record: Record) -> Vehicle:
    """A vehicle for this record: a residual that counts the heading counts it from where the record begins."""
    names = record.output_names
    return facing(vehicle, float(record.outputs[0, names.index(HEADING)])) if HEADING in names else vehicle


def first_part(record: Record, seconds: float) -> Record:
    """The first `seconds` of a record (all of it where it is shorter)."""
    n = min(record.time.size, round(seconds / record.dt) + 1)
    return replace(
        record, time=record.time[:n], inputs=record.inputs[:n], outputs=record.outputs[:n], voltage=record.voltage[:n]
    )


def calibrate(
    vehicle: Vehicle,
    record: Record,
    *,
    noise: Noise,
    prior: Nuisance,
    seconds: float = CALIBRATION,
    trims: Mapping[str, float] | None = None,
) -> Nuisance:
    """Delays, trims and lever arm of a record by maximum likelihood over its first seconds, the vehicle held.

    How late a log's motion is against its commands, where the tracked point lies and how the servos are trimmed differ
    from flight to flight. Nothing of the vehicle is moved, and nothing after `seconds` is seen.

    Args:
        prior: centre of the priors, e.g. what the fit found on its own records.
        trims: further trims to find, and the standard deviations of their priors; None: what the vehicle's card says.
    """
    vehicle = as_begun(vehicle, record)
    further = vehicle.card.observer.get("trims", {}) if trims is None else trims
    table = Parameterization(vehicle, (), of_records=tuple(trim_of_record(n, sigma) for n, sigma in further.items()))
    piece = first_part(record, seconds)
    likelihood = FilterError(table, [piece], noise=noise, estimate_noise=False, nuisance=prior)
    calibrated = likelihood.numbers(minimise(likelihood, Solver(iterations=30)).row)[0]
    return Nuisance(*calibrated.nuisance.tolist())
