"""A vehicle from flights, judged on others."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from swashplate.api.asking import called, strings
from swashplate.api.report_folder import ReportFolder
from swashplate.api.saying import Say
from swashplate.api.verbs.validate import Validate
from swashplate.engine.roots import require_casadi
from swashplate.errors import IdentificationError
from swashplate.flights.checked import check_disjoint
from swashplate.identification.core import stopping
from swashplate.identification.core.parameters import parameterize
from swashplate.identification.core.records import records
from swashplate.identification.core.result import Result
from swashplate.identification.estimators import check_method
from swashplate.identification.identify import identify
from swashplate.identification.posterior import check_posterior
from swashplate.identification.posterior import posterior as draw_posterior
from swashplate.identification.time.feedback import FlightDetails
from swashplate.models.catalogue import vehicle as find
from swashplate.models.vehicle import Vehicle
from swashplate.reporting.report import structure_of
from swashplate.reporting.structure import Report
from swashplate.reporting.summary import banners, summary
from swashplate.reporting.terminal_tables import fit_table
from swashplate.validation.controller_law import check_closed
from swashplate.validation.validation import Validation

if TYPE_CHECKING:
    from swashplate.api.verbs.identify import FitVehicle

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

    def to_document(self) -> dict[str, object]:
        """All of it as what becomes JSON, without time histories."""
        validation = self.validation and self.validation.to_document()
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

    @property
    def remarks(self) -> tuple[str, ...]:
        """What the user must know beside the report."""
        return ()

    @property
    def problems(self) -> tuple[str, ...]:
        """Why the fit, or its posterior, may not be used; empty where all is well."""
        if self.fit.failed:
            return (f"The fit failed: {' '.join(self.fit.problems) or 'see the report.'}",)
        return (f"The fit is written, its posterior is not: {self.refused}",) if self.refused else ()

    def parts(self) -> list[Any]:
        """What a terminal shows: tables and texts."""
        fit = self.fit
        shown: list[Any] = [fit_table(fit) if isinstance(fit.solution, Vehicle) else repr(fit)]
        shown += [f"\n{fit.posterior!r}"] if fit.posterior is not None else []
        return [*shown, "\n" + "\n".join(self.lines())]

    def lines(self) -> list[str]:
        """The report's own warnings and five lines, in words."""
        if not isinstance(self.fit.solution, Vehicle):
            return []
        told = [f"! {text}" for _, text in banners(self.fit, self.validation)]
        return told + [f"{label + ':':11} {words}" for label, words, _ in summary(self.fit, self.validation)]

    def __repr__(self) -> str:
        told = [] if self.fit.posterior is None else ["", repr(self.fit.posterior)]
        return "\n".join([repr(self.fit), *told, "", *self.lines()])


def identify_vehicle(asked: FitVehicle, say: Say) -> Identification:
    """The vehicle that was asked for, and how it predicts what its fit has not seen."""
    method, posterior, iterations = asked.method or "filter-error", asked.posterior, asked.iterations or 60
    card = (asked.prior or {}).get("")
    prior_card = None if card is None else find(card).card  # pyrefly: ignore[bad-argument-type]
    vehicle = asked.vehicle if isinstance(asked.vehicle, Vehicle) else find(asked.vehicle or "")
    require_casadi()
    say("reading flights")
    seen, unseen = asked.conditioned(asked.flight), asked.conditioned(asked.hold_out)
    named, free = (called(asked.flight), called(asked.hold_out)), strings(asked.free)
    check_disjoint([*seen, *unseen], None if None in named else [*(named[0] or ()), *(named[1] or ())])
    question: dict[str, Any] = {
        "free": free[0] if len(free) == 1 else free,
        "ties": strings(asked.tie),
        "fixed": asked.fix,
        "priors": {name: value for name, value in (asked.prior or {}).items() if name} or None,
        "prior_card": prior_card,
    }
    outputs, close_loop = None if asked.outputs is None else strings(asked.outputs), strings(asked.close_loop)
    # What can be said without computing is said at once, before the seconds that loading and compiling take.
    check_method(method)
    if posterior is not None:
        check_posterior(posterior)
        if posterior != "laplace" and asked.horizon is not None:
            raise IdentificationError(
                f"errors ahead are no likelihood, and {posterior} draws from one.",
                channel="posterior",
                hint="Leave --horizon away, or take 'laplace'.",
            )
    if close_loop:
        check_closed(vehicle, close_loop)
    if vehicle.structure is None or method in TRACKED:
        parameterize(vehicle, **question)
    if method in TRACKED:
        records([*seen, *unseen], vehicle, outputs=outputs)
    say("preparing the fit (compiling takes longest the first time)")
    with stopping.kept():
        fit = identify(
            vehicle,
            seen,
            method=method,
            outputs=outputs,
            iterations=iterations,
            keep_unexcited=asked.keep_unexcited,
            wind=asked.wind,
            leave_out=asked.leave_out,
            horizon=asked.horizon,
            residual=asked.residual,
            progress=lambda i, cost: say("fitting", done=i, total=iterations, note=f"iteration {i}, cost {cost:.6g}"),
            **question,
        )
    fit, refused = stopping.with_stop(fit), ""
    if posterior is not None and not fit.failed:
        drawing = f"drawing the posterior by {posterior}"
        say(drawing)
        try:
            fit = draw_posterior(fit, method=posterior, progress=lambda i, n: say(drawing, done=i, total=n))
        except IdentificationError as error:  # the fit is worth its minutes
            refused = str(error)
    validation = None
    if unseen and not fit.failed:
        say("validating on what the fit has not seen")
        validation = Validate(fit, unseen, close_loop=close_loop).answer(say)
    return Identification(fit, validation, refused)  # `records` has found the pose  # pyrefly: ignore[bad-argument-type]
