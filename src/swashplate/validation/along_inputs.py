"""Verification in time of any vehicle: its equations flown along records that no fit has seen.

As for linear models, the state at the start, constant shifts of the states' rates and constant biases of the outputs
are solved for (Tischler and Remple 2012, ch. 14); everything that moves has to come from the equations and the inputs.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from swashplate.errors import FlightError, SwashError
from swashplate.flights.flight import Flight, as_flights
from swashplate.flights.schema import channel
from swashplate.identification.core.parameters import Parameterization
from swashplate.identification.core.records import records
from swashplate.identification.core.result import Result
from swashplate.identification.core.scoring import Solver, minimise
from swashplate.identification.core.sources import sources_of
from swashplate.identification.responses.response_warnings import damaged
from swashplate.identification.time.vehicle_problem import VehicleErrors, measurable
from swashplate.models.linear.state_space import StateSpaceModel
from swashplate.models.surroundings import environment_of
from swashplate.models.vehicle import Vehicle
from swashplate.physics.environment import Environment
from swashplate.validation.saved import SavedWhole
from swashplate.validation.verification import Trace, Verification
from swashplate.validation.verify import verified, verify

if TYPE_CHECKING:
    import pandas as pd


def verify_vehicle(
    vehicle: Vehicle,
    flights: Flight | Sequence[Flight],
    *,
    outputs: Sequence[str] | None = None,
    shifts: bool = True,
    environment: Environment | None = None,
) -> Verification:
    """Fly a vehicle's equations along recorded inputs and compare.

    Args:
        vehicle: an identified one.
        flights: conditioned; not used for the fit.
        outputs: which to compare: states, their rates, the specific force; all that the flights have where None.
        shifts: solve for constant shifts of the states' rates too (else for output biases and start states only).
        environment: wind, density and gravity (None: the usual ones).

    Raises:
        FlightError: an input that the flights lack, or no output that both have.
        IdentificationError: equations that diverge along the record.
    """
    flights = as_flights(flights)
    known = measurable(vehicle)
    shared = tuple(n for n in (outputs or known) if n in known and all(n in f for f in flights))
    if not shared:
        raise FlightError(
            f"flight and vehicle share no output; '{vehicle.name}' predicts {', '.join(known)}.",
            where=flights[0].provenance.source or None,
            hint="Map the flight's columns to these names.",
        )
    pieces = records(flights, vehicle, outputs=shared)
    likelihood = VehicleErrors(
        Parameterization(vehicle, ()),
        pieces,
        gain="none",
        environment=environment_of(vehicle, environment),
        shifts=shifts,
        # A bias of a state is a shift of where it starts.
        biases=tuple(name for name in shared if name not in vehicle.state_names),
    )
    optimum = minimise(likelihood, Solver(tolerance=0.02))
    solved = dict(zip(likelihood.row.names, map(float, optimum.row * likelihood.row.scale), strict=True))
    traces = tuple(
        Trace(
            source=c.record.name,
            time=c.record.time,
            flight=c.record.outputs,
            model=c.model,
            inputs=c.record.inputs,
            biases={n: solved.get(f"bias {n}[{k}]", 0.0) for n in shared},
            shifts={s: solved[f"shift {s}[{k}]"] for s in vehicle.state_names} if shifts else {},
        )
        for k, c in enumerate(likelihood.comparisons(optimum.row))
    )
    names = (*vehicle.input_names, *vehicle.state_names)
    unit_of = dict(zip(names, (*vehicle.input_units, *vehicle.state_units), strict=True))
    units = {n: channel(n).unit for n in shared} | unit_of
    data = sources_of(flights)
    warnings = [*damaged(data), *([] if optimum.converged else ["the search for the start states did not end."])]
    if not all(np.all(np.isfinite(t.model)) for t in traces):
        raise FlightError("the equations diverge along the record.", where=pieces[0].name)
    return verified(
        vehicle,
        shared,
        traces,
        owners=[piece for flight in flights for piece in flight.split()],
        inputs=vehicle.input_names,
        units=units,
        warnings=warnings,
        data=data,
        settings={"shifts": shifts},
    )


def fitted(model: Any) -> Any:
    """The fit of what an identifying verb returned as one object (`sp.fit_tf`, `sp.fit_ss`); others as they are."""
    return getattr(model, "fit", None) or model


def along_inputs(
    model: Result[object, object] | Vehicle | StateSpaceModel,
    flights: Flight | Sequence[Flight],
    *,
    outputs: Sequence[str] | None = None,
) -> Verification:
    """Any model flown along recorded inputs: start states, shifts and biases are solved for.

    Args:
        model: what an identification returned, or a model. flights: conditioned.
        outputs: to compare; all that both have where None.

    Raises:
        FlightError: an input that the flights lack, or no output that both have.
    """
    model = fitted(model)
    held = model.model if isinstance(model, Result) else model
    if isinstance(held, Vehicle) and held.structure is None:
        return verify_vehicle(held, flights, outputs=outputs)
    return verify(held, flights, outputs=outputs)


@dataclass(frozen=True, repr=False)
class ModelComparison(SavedWhole):
    """Models beside one flight.

    Attributes:
        found: how each model follows the flight, by the model's name.
    """

    found: Mapping[str, Verification]

    def fits(self) -> dict[str, dict[str, float]]:
        """Fit [%] by output and model: 100 (1 - rms error / rms of the flight about its mean).

        The measure of MATLAB's `compare` (the normalised root mean square error, NRMSE). 100 is perfect; 0 is as good
        as the mean; below 0 is worse than that.
        """
        outputs = dict.fromkeys(o.output for v in self.found.values() for o in v.outputs)
        return {
            name: {who: o.fit for who, v in self.found.items() for o in v.outputs if o.output == name}
            for name in outputs
        }

    def to_document(self) -> dict[str, object]:
        """Fits and warnings as JSON types."""
        warnings = {name: list(v.warnings) for name, v in self.found.items() if v.warnings}
        return {"kind": "comparison", "fit": self.fits(), "warnings": warnings}

    def to_dataframe(self) -> pd.DataFrame:
        """Fit [%], one row an output and one column a model."""
        import pandas as pd

        return pd.DataFrame.from_dict(self.fits(), orient="index")

    def __repr__(self) -> str:
        width = max(12, *(len(name) + 2 for name in self.found))
        lines = ["Fit [%] = 100 (1 - rms error / rms of the flight about its mean)"]
        lines.append(f"  {'output':<12}" + "".join(f"{name:>{width}}" for name in self.found))
        for output, fits in self.fits().items():
            cells = (f"{fits[n]:>{width}.1f}" if n in fits else " " * (width - 1) + "-" for n in self.found)
            lines.append(f"  {output:<12}{''.join(cells)}")
        warnings = dict.fromkeys(f"! {n}: {text}" for n, v in self.found.items() for text in v.warnings)
        return "\n".join([*lines, *warnings])


def along_flights(
    named: Mapping[str, Any], flights: Flight | Sequence[Flight], *, outputs: Sequence[str] | None = None
) -> ModelComparison:
    """Models by name flown along recorded inputs; see `swashplate.compare`.

    Raises:
        SwashError: without a model.
        FlightError: an input that the flights lack, or no output that both have.
    """
    if not named:
        raise SwashError("there is no model to compare.", channel="models")
    return ModelComparison({name: along_inputs(model, flights, outputs=outputs) for name, model in named.items()})
