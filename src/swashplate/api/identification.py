"""The verb `identify_and_validate`: a vehicle from flights, judged on others."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

from swashplate.api.report_folder import ReportFolder
from swashplate.api.saying import Say, silent
from swashplate.errors import IdentificationError
from swashplate.flights.checked import check_disjoint
from swashplate.flights.flight import Flight, as_flights
from swashplate.identification.core import stopping
from swashplate.identification.core.parameters import parameterize
from swashplate.identification.core.records import records
from swashplate.identification.core.result import Result
from swashplate.identification.estimators import check_method
from swashplate.identification.identify import identify
from swashplate.identification.posterior import check_posterior
from swashplate.identification.posterior import posterior as draw_posterior
from swashplate.identification.time.feedback import FlightDetails
from swashplate.models.card import Card
from swashplate.models.traits import Free
from swashplate.models.vehicle import Vehicle
from swashplate.reporting.report import structure_of
from swashplate.reporting.structure import Report
from swashplate.reporting.summary import banners, summary
from swashplate.validation.controller_law import check_closed
from swashplate.validation.validation import Validation
from swashplate.validation.verb import validate

TRACKED = ("filter-error", "output-error")
"""Methods that are checked for a tracked pose before anything is computed."""


@dataclass(frozen=True, repr=False)
class Identification(ReportFolder):
    """A vehicle identified from flights, and how it predicts others.

    Attributes:
        fit: what the identification found.
        validation: on what the fit has not seen; None without such flights, or for a fit that has failed.
        refused: why a posterior that was asked for may not be used, in words; "" where none was, or it may.
    """

    files: ClassVar[tuple[str, ...]] = ("report.html", "model.toml", "fit.json", "validation.json", "posterior.nc")

    fit: Result[Vehicle, FlightDetails]
    validation: Validation | None
    refused: str = ""

    @property
    def model(self) -> Vehicle:
        """The vehicle with the identified numbers."""
        return self.fit.model

    def to_document(self) -> dict[str, Any]:
        """All of it as what becomes JSON, without time histories."""
        validation = self.validation and self.validation.as_dict()
        return {"fit": self.fit.to_document(comparisons=False), "validation": validation}

    def page(self, *, title: str | None = None) -> Report:
        """What `sp.report` writes."""
        return structure_of(self.fit, self.validation, title=title)

    def write(self, folder: Path) -> None:
        super().write(folder)
        self.fit.save(folder / "fit.json")
        if self.validation is not None:
            self.validation.save(folder / "validation.json")
        if not self.fit.failed:
            self.fit.model.save(folder / "model.toml")
        if self.fit.posterior is not None:
            self.fit.posterior.save(folder / "posterior.nc")

    def lines(self) -> list[str]:
        """The report's own warnings and five lines, in words."""
        if not isinstance(self.fit.solution, Vehicle):
            return []
        told = [f"! {text}" for _, text in banners(self.fit, self.validation)]
        return told + [f"{label + ':':11} {words}" for label, words, _ in summary(self.fit, self.validation)]

    def __repr__(self) -> str:
        told = [] if self.fit.posterior is None else ["", repr(self.fit.posterior)]
        return "\n".join([repr(self.fit), *told, "", *self.lines()])


def identify_and_validate(
    vehicle: Vehicle,
    flights: Flight | Iterable[Flight],
    *,
    hold_out: Flight | Iterable[Flight] = (),
    free: str | Sequence[str | Free] = "full",
    method: str = "filter-error",
    outputs: Sequence[str] | None = None,
    ties: Sequence[str] = (),
    fixed: Mapping[str, float] | None = None,
    priors: Mapping[str, tuple[float, float]] | None = None,
    prior_card: Card | None = None,
    iterations: int = 60,
    keep_unexcited: bool = False,
    wind: bool = False,
    leave_out: Sequence[tuple[float, float]] = (),
    horizon: Sequence[float] | None = None,
    residual: bool = False,
    close_loop: Sequence[str] = (),
    posterior: str | None = None,
    names: Sequence[str] | None = None,
    say: Say = silent,
) -> Identification:
    """Identify a vehicle from conditioned flights and, where it has not failed, predict others with it.

    Args:
        vehicle: the equations and the numbers to start from.
        flights: conditioned, with their pose tracked.
        hold_out: conditioned flights that the fit never sees.
        free, method, outputs, ties, fixed, priors, prior_card: as of `identify`.
        iterations, keep_unexcited, wind, leave_out, horizon, residual: as of `identify`.
        close_loop: as of `validate`.
        posterior: "laplace" or "nuts" for draws of what the fit does not know (`swashplate.posterior`).
            One that did not converge is left out, and `refused` says why.
        names: what the user calls the flights and the hold-outs, for messages.
        say: told what is being done.

    Raises:
        FlightError: where a hold-out is a stretch that the fit sees, or a flight lacks a channel.
        IdentificationError: where no fit can be started.
    """
    seen = as_flights(flights)
    unseen = as_flights(hold_out)
    check_disjoint([*seen, *unseen], names)
    # What can be said without computing is said at once, before the seconds that loading and compiling take.
    check_method(method)
    if posterior is not None:
        check_posterior(posterior)
        if posterior != "laplace" and horizon is not None:
            raise IdentificationError(
                f"errors ahead are no likelihood, and {posterior} draws from one.",
                channel="posterior",
                hint="Leave --horizon away, or take 'laplace'.",
            )
    if close_loop:
        check_closed(vehicle, close_loop)
    if vehicle.structure is None or method in TRACKED:
        parameterize(vehicle, free, ties=ties, fixed=fixed, priors=priors, prior_card=prior_card)
    if method in TRACKED:
        records([*seen, *unseen], vehicle, outputs=outputs)
    say("preparing the fit (compiling takes longest the first time)")
    with stopping.kept():
        fit = identify(
            vehicle,
            seen,
            free=free,
            method=method,
            outputs=outputs,
            ties=ties,
            fixed=fixed,
            priors=priors,
            prior_card=prior_card,
            iterations=iterations,
            keep_unexcited=keep_unexcited,
            wind=wind,
            leave_out=leave_out,
            horizon=horizon,
            residual=residual,
            progress=lambda i, cost: say("fitting", done=i, total=iterations, note=f"iteration {i}, cost {cost:.6g}"),
        )
    fit, refused = stopping.told(fit), ""
    if posterior is not None and not fit.failed:
        drawing = f"drawing the posterior by {posterior}"
        say(drawing)
        try:
            fit = draw_posterior(fit, method=posterior, progress=lambda i, n: say(drawing, done=i, total=n))
        except IdentificationError as error:  # the fit is worth its minutes
            refused = str(error)
    validation = None
    if unseen and not fit.failed:
        validating = "validating on what the fit has not seen"
        say(validating)
        validation = validate(
            fit, unseen, close_loop=close_loop, progress=lambda i, n: say(validating, done=i, total=n)
        )
    return Identification(fit, validation, refused)
