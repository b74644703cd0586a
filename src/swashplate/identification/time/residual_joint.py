"""Physics and residual by one likelihood: what the physics took over while it stood alone, it gives back.

A physics that is fitted without its residual leans towards what is missing, and a residual that is fitted beside a
physics that is held finds only the rest. So the search goes on with everything free: the physics with its own priors,
and the coefficients about zero with the ridge that the blocks chose (a ridge is a normal prior).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from swashplate.arrays import Array
from swashplate.identification.core.parameter_row import Row
from swashplate.identification.core.parameters import Free, Parameterization
from swashplate.identification.time.estimates import Found
from swashplate.identification.time.linear_residual import LinearResidual
from swashplate.models.residual import counted_from, with_residual
from swashplate.models.vehicle import Vehicle


def beside_physics(table: Parameterization, residual: LinearResidual) -> Parameterization:
    """What a fit has free, then the coefficients of its residual with the ridge as their priors."""
    spread = residual.strength**-0.5
    free = tuple(
        Free(name, unit, 0.0, spread * unit, source="ridge of the residual") for name, unit in residual.units.items()
    )
    return replace(table, vehicle=begun(table.vehicle, residual), free=(*table.free, *free))


def begun(vehicle: Vehicle, residual: LinearResidual) -> Vehicle:
    """A vehicle with coefficients that are still zero, counted from where those of a residual are."""
    return with_residual(vehicle, counted_from(residual.vehicle))


def begun_where_it_ended(row: Row, alone: Row, reached: Array, residual: LinearResidual) -> Array:
    """The scaled row with everything free: records and noise as found alone, physics and residual as found together."""
    known = dict(zip(alone.names, (reached * alone.scale).tolist(), strict=True))
    known |= {name: entry.value for name, entry in residual.vehicle.card.parameters.items() if name in row.names}
    return np.array([known[name] for name in row.names]) / row.scale


def moved(alone: Found, together: Found) -> dict[str, float]:
    """How far the physics moved, in standard deviations of what is free with the residual."""
    sigma = np.sqrt(np.maximum(np.diag(together.scaled(together.corrected)), 1e-300))
    before = alone.table.identified(alone.numbers[: len(alone.table.free)])
    after = together.table.identified(together.numbers[: len(together.table.free)])
    return {name: (after[name] - before[name]) / float(sigma[i]) for i, name in enumerate(alone.table.names)}
