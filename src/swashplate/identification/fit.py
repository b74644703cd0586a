"""`Fit`: what an identification found, how sure it is, and what it could not see."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from swashplate.flights.flight import Array, Flight
from swashplate.identification.records import Record
from swashplate.identification.stochastic import Noise, Nuisance
from swashplate.vehicles.vehicle import Vehicle


@dataclass(frozen=True)
class Estimate:
    """One estimated number.

    Attributes:
        name, unit: as on the card.
        published: the card's value before the fit.
        value: the estimate.
        sigma: Cramér-Rao bound, prior included [same unit].
        sigma_corrected: the bound corrected for coloured residuals (Morelli and Klein 1997).
        prior_mean, prior_sigma: the prior, None where the data alone decided.
        prior_share: part of the information that came from the prior, 0 (data alone) to 1 (prior alone).
        at_bound: True where the fit ended on a bound of physics.
        tie: the expression that ties it to others ("" where it was free).
    """

    name: str
    unit: str
    published: float
    value: float
    sigma: float
    sigma_corrected: float
    prior_mean: float | None = None
    prior_sigma: float | None = None
    prior_share: float = 0.0
    at_bound: bool = False
    tie: str = ""


@dataclass(frozen=True)
class RecordEstimate:
    """One number of a flight (the log `record`): a delay [s], a trim [1], a lever arm [m] or a level [rad]."""

    record: str
    name: str
    unit: str
    value: float
    sigma: float


@dataclass(frozen=True)
class Direction:
    """A combination of parameters that the data hardly see.

    Attributes:
        weights: by parameter, in units of its scale, of length one.
        sigma: uncertainty along it, in the same units (1 means: of the order of the parameters' scales).
        words: the same in words.
    """

    weights: Mapping[str, float]
    sigma: float
    words: str


@dataclass(frozen=True)
class AxisExcitation:
    """Whether a record moves an axis independently of what the aircraft did.

    Attributes:
        record: the record's name.
        axis: "roll", "pitch", "yaw" or "heave".
        command: the input that drives it.
        explained: part of the command's variance that past motion explains (1: a controller's answer to the motion;
            NaN where the command stands still or the record is too short to tell).
        coherence: largest coherence between command and motion in the band.
        phase: phase of motion over command there [rad] (NaN where the command stands still).
        power: standard deviation of the command in the band [1].
        identifiable: False where there is no independent excitation.
        words: the finding, and what to fly instead.
        explained_later: part of the command's variance that the motion after it explains.
    """

    record: str
    axis: str
    command: str
    explained: float
    coherence: float
    phase: float
    power: float
    identifiable: bool
    words: str
    explained_later: float = float("nan")


@dataclass(frozen=True)
class Comparison:
    """Flight and model over one record used for the fit.

    Attributes:
        record: the record.
        counted: which samples the cost counted, shape (n,).
        model: model outputs, shape (n, n_outputs): one-step predictions (prediction error) or simulation.
        sigma: standard deviation of the model's output error, shape (n_outputs,).
        states: estimated body states (n, 12) in the order x y z u v w phi theta psi p q r.
    """

    record: Record
    counted: Array
    model: Array
    sigma: Array
    states: Array

    @property
    def residuals(self) -> Array:
        return np.asarray(self.record.outputs - self.model, dtype=np.float64)


@dataclass(frozen=True)
class Fit:
    """The result of an identification.

    Attributes:
        vehicle: the identified vehicle; its card says what was identified.
        published: the vehicle before the fit.
        method: "prediction-error", "output-error" or "nelder-mead".
        choice: the ready choice or "given".
        parameters: estimates, free ones first, then tied ones.
        record_estimates: delays, trims and lever arms by flight.
        noise: process and measurement noise (None where the method has none).
        nuisance: the records' mean nuisance, what a prediction on another flight uses.
        names: free parameters in the order of the matrices below.
        covariance, covariance_corrected: of the free parameters in their units.
        correlation: of the free parameters.
        directions: what the data hardly see, worst first.
        excitation: per record and axis.
        history: cost after each iteration.
        converged: False where the iterations ran out.
        problems: what is wrong with the fit, in words; a fit with non-physical values is a failed fit.
        failed: True where the numbers must not be used.
        comparisons: flight against model.
        flights: the conditioned flights, with their histories.
        seconds: wall time of the estimation.
        settings: what was asked.
    """

    vehicle: Vehicle
    published: Vehicle
    method: str
    choice: str
    parameters: tuple[Estimate, ...]
    record_estimates: tuple[RecordEstimate, ...]
    noise: Noise | None
    nuisance: Nuisance
    names: tuple[str, ...]
    covariance: Array
    covariance_corrected: Array
    correlation: Array
    directions: tuple[Direction, ...]
    excitation: tuple[AxisExcitation, ...]
    history: tuple[float, ...]
    converged: bool
    problems: tuple[str, ...]
    failed: bool
    comparisons: tuple[Comparison, ...]
    flights: tuple[Flight, ...]
    seconds: float
    settings: Mapping[str, Any] = field(default_factory=dict)

    def __getitem__(self, name: str) -> Estimate:
        return next(estimate for estimate in self.parameters if estimate.name == name)

    def as_dict(self) -> dict[str, Any]:
        """Numbers and words of the fit as JSON types (no time histories)."""
        return {
            "kind": "fit",
            "vehicle": self.vehicle.name,
            "method": self.method,
            "choice": self.choice,
            "converged": self.converged,
            "failed": self.failed,
            "problems": list(self.problems),
            "seconds": self.seconds,
            "cost_history": list(self.history),
            "parameters": [vars(estimate) for estimate in self.parameters],
            "records": [vars(estimate) for estimate in self.record_estimates],
            "noise": None if self.noise is None else {k: float(v) for k, v in self.noise._asdict().items()},
            "names": list(self.names),
            "covariance": self.covariance.tolist(),
            "covariance_corrected": self.covariance_corrected.tolist(),
            "correlation": self.correlation.tolist(),
            "directions": [vars(d) | {"weights": dict(d.weights)} for d in self.directions],
            "excitation": [vars(axis) for axis in self.excitation],
            "flights": [vars(f.provenance) | {"history": [vars(s) for s in f.history]} for f in self.flights],
            "settings": dict(self.settings),
        }

    def __repr__(self) -> str:
        rows = [
            f"{e.name:22s} {e.published:12.5g} {e.value:12.5g} {e.sigma_corrected:10.2g}  {e.unit}"
            + ("  at its bound" if e.at_bound else "")
            + (f"  = {e.tie}" if e.tie else "")
            for e in self.parameters
        ]
        head = f"{'parameter':22s} {'published':>12s} {'identified':>12s} {'sigma':>10s}  unit"
        state = "FAILED" if self.failed else ("converged" if self.converged else "not converged")
        lines = [f"Fit of {self.vehicle.name} by {self.method}: {state}, {self.seconds:.1f} s", head, *rows]
        return "\n".join([*lines, *(f"! {problem}" for problem in self.problems)])
