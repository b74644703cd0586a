"""The public verb: results become a page."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Protocol, runtime_checkable

from swashplate.bench.result import BenchDetails
from swashplate.errors import SwashError
from swashplate.identification.core.result import Result
from swashplate.identification.responses.frequency_response import FrequencyResponse
from swashplate.models.linear.state_space import StateSpaceModel
from swashplate.models.vehicle import Vehicle
from swashplate.reporting.bench import compose_bench
from swashplate.reporting.compose import compose
from swashplate.reporting.figures.sections import own_section
from swashplate.reporting.html import write_page
from swashplate.reporting.response_report import compose_responses
from swashplate.reporting.sections_responses import ResponseMaterial
from swashplate.reporting.structure import Report
from swashplate.shown import Shown
from swashplate.simulation.linearize import Mode
from swashplate.validation.validation import Validation
from swashplate.validation.verification import Verification

Reportable = Result[object, object] | Validation | Verification | FrequencyResponse


@runtime_checkable
class HasPage(Protocol):
    """A result that knows its own page: a check, a design, many flights."""

    def page(self, *, title: str | None = None) -> Report:
        """The page's structure under a heading, its own where None."""
        ...


def report(
    *results: Shown | HasPage | None,
    path: str | os.PathLike[str],
    title: str | None = None,
    modes: Mapping[str, Sequence[Mode]] | None = None,
) -> Path:
    """Write one self-contained HTML file about what was found.

    The file needs no network: plotly.js and all data are in it. It appears by rename when it is complete.

    Args:
        results: of any identification, a validation or a verification of it (its own where none is given), measured
            responses; None is left out. A
            page is about one vehicle's fit and validation, or about linear models, their responses and verification.
            All else that plots (a flight, a spectrum, trims, a check of a controller ...) makes a page alone.
        path: where to write; the folder is made where it is missing.
        title: heading; made from the models and the flights where None.
        modes: eigenvalues at hover by vehicle ("published", "identified"); computed where None.

    Returns:
        The file's path.

    Raises:
        SwashError: nothing to report, results that share no page, or a place that cannot be written to.
    """
    return write_page(path, structure_of(*results, title=title, modes=modes))


def structure_of(
    *results: Shown | HasPage | None,
    title: str | None = None,
    modes: Mapping[str, Sequence[Mode]] | None = None,
) -> Report:
    """What `report` writes, before it is a page; arguments and errors as there."""
    judged = any(isinstance(one, Validation | Verification) for one in results)
    held_out = [one.validation for one in results if isinstance(one, Result) and not judged]
    asked = [one for one in (*results, *held_out) if one is not None]
    if not asked:
        raise SwashError("there is nothing to report: neither a result nor a validation was given.")
    given: list[Reportable] = []
    for one in asked:
        if isinstance(one, Result | Validation | Verification | FrequencyResponse):
            given.append(one)
        elif len(asked) > 1 or modes is not None:
            raise SwashError("has a page of its own.", channel=type(one).__name__, hint="Write a report of each.")
        else:
            return one.page(title=title) if isinstance(one, HasPage) else _of_one(one, title)
    of_vehicles = [one for one in given if isinstance(one, Validation) or _is_of(one, Vehicle)]
    if not of_vehicles:
        return _of_linear_models(given, title)
    checks = [one for one in given if isinstance(one, Verification) and isinstance(one.model, Vehicle)]
    if len(of_vehicles) + len(checks) < len(given):
        raise SwashError("a vehicle's fit and a linear model share no page.", hint="Write a report of each.")
    fit = _only([one for one in given if isinstance(one, Result)], "fit")
    if fit is not None and isinstance(fit.details, BenchDetails):
        if len(given) > 1:
            raise SwashError("the bench has a page of its own.", hint="Write a report of each.")
        return compose_bench(fit)
    validation = _only([one for one in given if isinstance(one, Validation)], "validation")
    verification = _only(checks, "verification")
    return compose(fit, validation, verification, title=title, modes=modes)


def _of_one(shown: object, title: str | None) -> Report:
    """The page of what shows itself in one section: a flight, a spectrum, models along a flight."""
    section = own_section(shown)
    if section is None:
        raise SwashError("has nothing that a page could show.", channel=type(shown).__name__, hint="Print it.")
    return Report(title or section.title, (), (), None, (replace(section, identifier="shown"),))


def _of_linear_models(given: Sequence[Reportable], title: str | None) -> Report:
    models = [one for one in given if isinstance(one, Result) and isinstance(one.solution, StateSpaceModel)]
    material = ResponseMaterial(
        responses=_only([one for one in given if isinstance(one, FrequencyResponse)], "frequency response"),
        transfer_functions=tuple(one for one in given if _is_of(one, tuple)),  # pyrefly: ignore[bad-argument-type]
        fit=_only([one for one in models if one.targets], "fit to responses"),
        verification=_only([one for one in given if isinstance(one, Verification)], "verification"),
        time_fit=_only([one for one in models if not one.targets], "fit in time"),
    )
    return compose_responses(material, title=title)


def _is_of(one: object, kind: type) -> bool:
    return isinstance(one, Result) and isinstance(one.solution, kind)


def _only(results: Sequence[Any], what: str) -> Any:
    if len(results) > 1:
        raise SwashError(f"{len(results)} results of the kind '{what}' were given, a page is about one.")
    return results[0] if results else None
