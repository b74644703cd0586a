"""Which axes of a flight can be identified: what moved an input that the flight's past motion does not explain."""

from __future__ import annotations

from swashplate.filtering.nuisance import Nuisance
from swashplate.flights.flight import Flight
from swashplate.identification.core.records import records
from swashplate.identification.time import feedback
from swashplate.identification.time.feedback import AxisExcitation
from swashplate.identification.time.kinematics import measured_states
from swashplate.models.vehicle import Vehicle


def excitation(vehicle: Vehicle, flight: Flight, *, shortest: float = 0.0) -> tuple[tuple[AxisExcitation, ...], ...]:
    """Independent excitation of each axis, one row a record (an unbroken piece of the flight).

    Args:
        vehicle: whose axes and inputs they are.
        flight: conditioned, with pose and inputs.
        shortest: records that are shorter are left out [s].

    Raises:
        FlightError: where the flight lacks channels of the vehicle or is not conditioned.
    """
    return tuple(
        feedback.excitation(vehicle, record, measured_states(record, Nuisance()))
        for record in records(flight, vehicle)
        if record.time[-1] - record.time[0] > shortest
    )
