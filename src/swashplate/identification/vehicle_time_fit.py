"""`fit_vehicle`: parameters of any vehicle's nonlinear equations from records of whatever was measured.

`identify` knows how small helicopters fly, are tracked and are blown about, and is the better choice for them. This one
asks for nothing but the equations: an aeroplane with its own states, vanes and accelerometers is a `Vehicle` like any
other.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

from swashplate.errors import IdentificationError
from swashplate.flights.flight import Flight
from swashplate.identification.parameters import Free, parameterize
from swashplate.identification.records import records
from swashplate.identification.time_fit import TimeFit, check_method, solve
from swashplate.identification.vehicle_likelihood import VehicleErrors
from swashplate.physics.environment import Environment
from swashplate.simulation.compilation import enable_compilation_cache
from swashplate.simulation.dynamics import enable_double_precision
from swashplate.vehicles.vehicle import Vehicle


def fit_vehicle(
    vehicle: Vehicle,
    flights: Flight | Sequence[Flight],
    *,
    free: Sequence[str | Free],
    outputs: Sequence[str],
    method: str = "filter-error",
    ties: Sequence[str] = (),
    priors: Mapping[str, tuple[float, float]] | None = None,
    environment: Environment | None = None,
    shifts: bool = False,
    biases: Sequence[str] = (),
    iterations: int = 80,
    progress: Callable[[int, float], None] | None = None,
) -> TimeFit[Vehicle]:
    """Fit parameters of a vehicle's equations to records in time by maximum likelihood.

    Inputs are straight lines between samples; delays must have been taken out.

    Args:
        vehicle: the equations and the card to start from.
        flights: conditioned; each unbroken piece is a record with its own start state and constants.
        free: names of the parameters to move (a `Free` has a scale and a prior).
        outputs: channels to fit: states, their rates ("qdot") and the specific force ("ax", "ay", "az").
        method: "filter-error" (gusts: white noise on every state's rate), "prediction-error" (any stationary gust: a
            free gain, for long records) or "output-error" (no gusts).
        ties, priors: see `parameterize`.
        environment: wind, density and gravity (None: the usual ones).
        shifts: constants in the states' rates, per record.
        biases: outputs with a constant of their own, per record.
        iterations: at most this many.
        progress: called with the iteration and the cost.

    Returns:
        The fit; `model` is the vehicle with the numbers found.

    Raises:
        IdentificationError: an unknown method, parameter or output, or a model that diverges at its start values.
        FlightError: where a flight lacks a channel or is not on a uniform grid.
    """
    check_method(method)
    enable_double_precision()
    enable_compilation_cache()
    outputs = tuple(outputs)
    unknown = [name for name in biases if name not in outputs]
    if unknown:
        raise IdentificationError(f"is none of the outputs {', '.join(outputs)}.", channel=", ".join(unknown))
    table = parameterize(vehicle, free, ties=ties, priors=priors)
    pieces = records(flights, vehicle, outputs=outputs)
    likelihood = VehicleErrors(
        table,
        pieces,
        method=method,
        environment=environment or Environment(),
        shifts=shifts,
        biases=tuple(biases),
    )
    units = [vehicle.card.parameters[name].unit for name in table.names]
    solved = solve(likelihood, units, iterations=iterations, progress=progress)
    sources = tuple(piece.name for piece in pieces)
    card = table.vehicle.card
    origin = f"identified by {method} from {', '.join(sources)}"
    sigmas = {p.name: p.cramer_rao for p in solved.parameters}
    for name, value in table.identified([solved.numbers[n] for n in table.names]).items():
        card = card.with_values({name: value}, status="identified", sigma=sigmas.get(name), source=origin)
    card = replace(card, title=f"{card.title}, {origin.replace(f' by {method}', '')}", path="")
    return TimeFit(
        model=table.vehicle.with_card(card),
        parameters=solved.parameters,
        covariance=likelihood.covariance,
        constants=solved.constants,
        history=solved.optimum.history,
        converged=solved.optimum.converged,
        method=method,
        warnings=solved.warnings,
        sources=sources,
    )
