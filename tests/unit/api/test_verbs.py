"""What a verb computes prints itself, is saved and makes a page."""

from __future__ import annotations

import inspect
import types
import typing
from importlib import import_module
from typing import Any

import pytest

from swashplate.reporting.figures.sections import SECTIONS
from swashplate.reporting.report import HasPage, Reportable

STUDIES = (
    "swashplate.api.campaigns.verbs:campaign",
    "swashplate.api.campaigns.results:campaign_results",
    "swashplate.api.check_controller:check_controller",
    "swashplate.identification.responses.arithmetic:combine",
    "swashplate.api.compare:compare",
    "swashplate.api.decouple:decouple",
    "swashplate.api.decouple_axes:decouple_axes",
    "swashplate.api.demo:demo",
    "swashplate.simulation.derivatives_over_speed:derivatives",
    "swashplate.api.design_controller:design_controller",
    "swashplate.api.bench:evaluate_bench",
    "swashplate.api.fit_ss:fit_ss",
    "swashplate.api.fit_tf:fit_tf",
    "swashplate.api.fit_time:fit_time",
    "swashplate.api.fly_maneuver:fly_maneuver",
    "swashplate.api.identification:identify_and_validate",
    "swashplate.api.monte_carlo:monte_carlo",
    "swashplate.identification.responses.respond:respond",
    "swashplate.api.campaigns.verbs:resume_campaign",
    "swashplate.api.track:track",
    "swashplate.simulation.trim_curve:trim_curve",
    "swashplate.api.validate_linear:validate_linear",
)
"""Verbs whose result is worth a page."""


def _load(place: str) -> Any:
    module, _, name = place.partition(":")
    return getattr(import_module(module), name)


def _returned(verb: Any) -> list[type]:
    """The classes that a function says it returns."""
    found = typing.get_type_hints(verb)["return"]
    kinds = typing.get_args(found) if isinstance(found, types.UnionType) else (found,)
    return [typing.get_origin(kind) or kind for kind in kinds]


@pytest.mark.parametrize("name", STUDIES)
def test_its_result_prints_is_saved_and_makes_a_page(name: str) -> None:
    known = tuple(typing.get_origin(kind) or kind for kind in typing.get_args(Reportable))
    for kind in _returned(_load(name)):
        assert "__repr__" in vars(kind)
        assert issubclass(kind, known) or hasattr(kind, "page") or kind.__name__ in SECTIONS
        assert hasattr(kind, "to_document") or hasattr(kind, "as_dict")
        assert callable(kind.save)


def test_a_result_without_a_page_is_found() -> None:
    def verb() -> inspect.Signature: ...

    assert not any(hasattr(kind, "page") for kind in _returned(verb))
    assert HasPage in HasPage.__mro__
