"""Flights of many vehicles of one kind."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from swashplate.flights.flight import Flight
from swashplate.models.vehicle import Vehicle
from swashplate.simulation.record import check_divergence, simulated_flight

Precision = Literal["float64", "float32"]


@dataclass(frozen=True)
class Batch:
    """Flights of many vehicles.

    Attributes:
        vehicle: their equations.
        time: of the kept samples [s], shape (n,).
        states: shape (n, n_states, n_vehicles).
        rows: inputs and surroundings at the kept samples, shape (n, n_inputs + 4, n_vehicles or 1).
    """

    vehicle: Vehicle
    time: NDArray[np.float64]
    states: NDArray[Any]
    rows: NDArray[Any]

    def __len__(self) -> int:
        return int(self.states.shape[2])

    def __getitem__(self, name: str) -> NDArray[Any]:
        """One state of all vehicles, shape (n, n_vehicles)."""
        return self.states[:, self.vehicle.index(name), :]

    def flight(self, number: int) -> Flight:
        """The flight of one vehicle.

        Raises:
            DivergenceError: where that vehicle diverged.
        """
        states = np.asarray(self.states[:, :, number], dtype=np.float64)
        rows = np.asarray(self.rows[:, :, min(number, self.rows.shape[2] - 1)], dtype=np.float64)
        flight = simulated_flight(self.vehicle, self.time, states, rows, details={"number": number})
        check_divergence(self.vehicle, self.time, states, flight)
        return flight
