"""From a fit and a validation (or one of them) to the structure of a report."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from swashplate.errors import SwashError
from swashplate.identification.core.result import Result
from swashplate.identification.estimators import GAINS
from swashplate.models.vehicle import Vehicle
from swashplate.reporting import sections_data, sections_fit, sections_prior, sections_sight, sections_validation
from swashplate.reporting.figures_validation import key_picture
from swashplate.reporting.glossary import PARAMETERS
from swashplate.reporting.sections_verification import verification_section
from swashplate.reporting.structure import Figure, Report, Section
from swashplate.reporting.summary import banners, summary
from swashplate.reporting.terms import with_terms
from swashplate.simulation.linearize import Mode, linearize
from swashplate.validation.validation import Validation
from swashplate.validation.verification import Verification


def compose(
    fit: Result[Vehicle, object] | None = None,
    validation: Validation | None = None,
    verification: Verification | None = None,
    *,
    title: str | None = None,
    modes: Mapping[str, Sequence[Mode]] | None = None,
) -> Report:
    """A report's structure.

    Args:
        fit, validation: one of them at least.
        verification: of a vehicle that was flown along records.
        title: heading; made from the vehicle and the flights where None.
        modes: eigenvalues at hover by vehicle ("published", "identified"); computed where None.

    Raises:
        SwashError: where there is nothing to report.
    """
    if fit is None and validation is None:
        raise SwashError("there is nothing to report: neither a fit nor a validation was given.")
    at_hover, problems = (modes, []) if modes is not None else hover_modes(fit, validation)
    hover = sections_sight.hover(at_hover, problems)
    fit_in_time = fit if fit and fit.in_time else None
    one_step = fit_in_time is not None and GAINS.get(fit_in_time.method, "none") != "none" and validation is not None
    parts: list[Section | None] = [
        sections_validation.verdict(validation) if validation else None,
        sections_validation.prediction(validation) if validation else None,
        _with_warnings(fit) if fit else None,
        sections_prior.prior(fit) if fit else None,
        sections_sight.sight(fit) if fit else None,
        # One sample ahead any model lies on the flight: where a flight is predicted, that is what is looked at.
        sections_fit.comparison(fit_in_time) if fit_in_time and not one_step else None,
        verification_section(verification) if verification else None,
        sections_fit.residuals(fit_in_time) if fit_in_time else None,
        sections_validation.innovations(validation) if validation and validation.innovations else None,
        hover,
        sections_data.data(fit, validation),
        sections_fit.meanings(fit, PARAMETERS) if fit else None,
        _provenance(fit, validation),
    ]
    sections = tuple(part for part in parts if part is not None)
    lines = summary(fit, validation)
    return Report(
        title=title or _title(fit, validation),
        banners=banners(fit, validation),
        summary=tuple(sorted(lines, key=lambda line: _FIRST.get(line[0], 2))),
        picture=_picture(fit, validation),
        sections=with_terms(sections, lines),
        verdict=sections_validation.verdict_in_short(validation) if validation else None,
    )


_FIRST = {"Verdict": 0, "Warnings": 1}
"""Lines of the summary that a page begins with."""


def _provenance(fit: Result[Vehicle, object] | None, validation: Validation | None) -> Section:
    noise = sections_fit.noise(fit) if fit else None
    blocks = (
        *sections_data.asked(fit, validation),
        *([noise] if noise else []),
        *sections_data.made_with(fit, validation),
    )
    return Section("made", "How was this made?", blocks, folded=True)


def hover_modes(
    fit: Result[Vehicle, object] | None, validation: Validation | None
) -> tuple[dict[str, Sequence[Mode]], list[str]]:
    """Modes of the published and the identified vehicle at hover, and why one has none."""
    modes: dict[str, Sequence[Mode]] = {}
    problems = []
    for label, vehicle in sections_data.vehicles(fit, validation).items():
        try:
            modes[label] = linearize(vehicle).modes()
        except SwashError as error:
            problems.append(f"The {label} vehicle has no eigenvalues at hover: {error}")
    return modes, problems


def _with_warnings(fit: Result[Vehicle, object]) -> Section:
    section = sections_fit.parameters(fit)
    warned = sections_fit.warnings(fit)
    return replace(section, blocks=(warned, *section.blocks)) if warned else section


def _picture(fit: Result[Vehicle, object] | None, validation: Validation | None) -> Figure | None:
    """The key picture: the race of the predictors; without a validation, flight against model in roll and pitch."""
    if validation and validation.scores:
        return key_picture(validation)
    if fit and fit.in_time:
        figures = [b for b in sections_fit.comparison(fit).blocks if isinstance(b, Figure)]
        return replace(figures[0], identifier="key-picture") if figures else None
    return None


def _title(fit: Result[Vehicle, object] | None, validation: Validation | None) -> str:
    source = fit.data if fit else validation.data if validation else ()
    names = list(dict.fromkeys(f.name for f in source if f.name))
    verb = "identified from" if fit else "predicting"
    vehicle = sections_data.vehicles(fit, validation)["identified"]
    return f"{vehicle.card.called} {verb} {', '.join(names[:2]) or 'a flight'}"
