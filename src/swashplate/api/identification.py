"""A model from flights, judged on others."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from swashplate.api.asking import called, strings
from swashplate.api.saying import Say
from swashplate.api.verbs.validate import Validate
from swashplate.engine.roots import require_casadi
from swashplate.errors import IdentificationError
from swashplate.flights.checked import check_disjoint
from swashplate.identification.core import stopping
from swashplate.identification.core.records import records
from swashplate.identification.core.result import Result
from swashplate.identification.estimators import check_method
from swashplate.identification.identify import identify
from swashplate.identification.posterior import check_posterior
from swashplate.identification.posterior import posterior as draw_posterior
from swashplate.identification.responses.frequency_response import FrequencyResponse
from swashplate.models.card import Card
from swashplate.models.catalogue import vehicle as find
from swashplate.models.vehicle import Vehicle
from swashplate.reporting.report import report
from swashplate.reporting.summary import banners, summary
from swashplate.reporting.terminal_tables import fit_table
from swashplate.validation.controller_law import check_closed
from swashplate.validation.validation import Validation

if TYPE_CHECKING:
    from swashplate.api.verbs.identify import FitVehicle


def write_fit(fit: Result[object, object], folder: Path) -> None:
    """The page, the model, the fit, and what was drawn and judged, into a folder that is there."""
    report(fit, path=folder / "report.html")
    fit.save(folder / "fit.json")
    if fit.validation is not None:
        name = "validation" if isinstance(fit.validation, Validation) else "verification"
        fit.validation.save(folder / f"{name}.json")
    if not fit.failed:
        fit.model.save(folder / "model.toml")
    if fit.posterior is not None:
        fit.posterior.save(folder / "posterior.nc")


def fit_parts(fit: Result[object, object]) -> list[Any]:
    """What a terminal shows: tables, the report's warnings and its five lines, in words."""
    if not isinstance(fit.solution, Vehicle):
        return [repr(fit)]
    told = [f"! {text}" for _, text in banners(fit, fit.validation)]
    told += [f"{label + ':':11} {words}" for label, words, _ in summary(fit, fit.validation)]
    return [fit_table(fit), *([f"\n{fit.posterior!r}"] if fit.posterior is not None else []), "\n" + "\n".join(told)]


def identify_vehicle(asked: FitVehicle, say: Say) -> Result[object, object]:
    """The model that was asked for, with how it predicts what its fit has not seen."""
    posterior, close_loop = asked.posterior, strings(asked.close_loop)
    most = asked.iterations or 60  # what a line of progress counts up to; a search ends sooner or by its own number
    prior: Mapping[str, Any] = asked.prior if isinstance(asked.prior, Mapping) else {"": asked.prior}
    card = prior.get("")
    vehicle = find(asked.vehicle or "") if isinstance(asked.vehicle, str | Path | None) else asked.vehicle
    require_casadi()
    say("reading flights")
    responses = asked.flight if isinstance(asked.flight, FrequencyResponse) else None
    seen, unseen = asked.conditioned(asked.flight if responses is None else None), asked.conditioned(asked.hold_out)
    named, free = (called(asked.flight), called(asked.hold_out)), strings(asked.free)
    check_disjoint([*seen, *unseen], None if None in named else [*(named[0] or ()), *(named[1] or ())])
    # What can be said without computing is said at once, before the seconds that loading and compiling take.
    check_method(asked.method)
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
    if unseen and isinstance(vehicle, Vehicle) and vehicle.structure is None:
        records(unseen, vehicle, outputs=None if asked.outputs is None else strings(asked.outputs))
    say("preparing the fit (compiling takes longest the first time)")
    with stopping.kept():
        fit = identify(
            vehicle,
            seen if responses is None else responses,
            free=(free[0] if len(free) == 1 else free) or None,
            prior={name: value for name, value in prior.items() if name} or None,
            prior_card=card if card is None or isinstance(card, Card) else find(card).card,
            progress=lambda i, cost: say("fitting", done=i, total=most, note=f"iteration {i}, cost {cost:.6g}"),
            **asked.to_estimators(),
        )
    fit = stopping.with_stop(fit)
    if posterior is not None and not fit.failed:
        drawing = f"drawing the posterior by {posterior}"
        say(drawing)
        try:
            fit = draw_posterior(fit, method=posterior, progress=lambda i, n: say(drawing, done=i, total=n))
        except IdentificationError as error:  # the fit is worth its minutes
            fit = replace(fit, warnings=(*fit.warnings, str(error)))
    if unseen and not fit.failed:
        say("validating on what the fit has not seen")
        fit = replace(fit, validation=Validate(fit, unseen, close_loop=close_loop).answer(say))
    return fit
