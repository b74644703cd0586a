"""What shows an object by itself, by its class: the section that `plot`, `explore`, notebooks and reports take."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from swashplate.registry import Registry
from swashplate.reporting.structure import Section

_HERE = "swashplate.reporting.figures"
_RESULTS = f"{_HERE}.of_results"
SECTIONS: Registry[Callable[..., Section]] = Registry(
    "sections",
    what="an object that shows itself",
    own={
        "Flight": f"{_HERE}.of_flight:section_of_flight",
        "FlightReview": f"{_HERE}.of_review:section_of_review",
        "Inspection": f"{_HERE}.of_flight:section_of_inspection",
        "FrequencyResponse": f"{_HERE}.views:section_of_responses",
        "ModelComparison": f"{_HERE}.of_comparison:section_of_comparison",
        "Residuals": f"{_HERE}.of_comparison:section_of_residuals",
        "Suggestion": f"{_HERE}.views:section_of_gains",
        "TrimCurve": f"{_RESULTS}:section_of_trims",
        "Derivatives": f"{_RESULTS}:section_of_derivatives",
        "LinearModel": f"{_RESULTS}:section_of_linear_model",
        "EquationError": f"{_RESULTS}:section_of_equation",
        "Harmonics": f"{_RESULTS}:section_of_harmonics",
        "PlannedManeuver": f"{_RESULTS}:section_of_planned",
        "RateSteps": f"{_RESULTS}:section_of_steps",
        "Reconstruction": f"{_RESULTS}:section_of_reconstruction",
        "Spectrogram": f"{_RESULTS}:section_of_spectrogram",
        "Spectrum": f"{_RESULTS}:section_of_spectrum",
    },
)
"""What shows an object, by the name of its class; loaded when it is asked for."""


def own_section(shown: Any, **choice: Any) -> Section | None:
    """The section of an object of a class that has one; None for others, which have a page or nothing."""
    for kind in type(shown).__mro__:
        if kind.__name__ in SECTIONS:
            return SECTIONS[kind.__name__](shown, **choice)
    return None
