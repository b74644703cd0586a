"""What a verb computes prints itself, is saved and makes a page; a function of `sp` is its question."""

from __future__ import annotations

import inspect
import pickle
import typing
from importlib import import_module
from typing import Any

import numpy as np
import pytest

import swashplate as sp
from swashplate.flights.conditioning.uniform_records import is_uniform
from swashplate.flights.flight import Flight, stream
from swashplate.reporting.figures.sections import SECTIONS
from swashplate.reporting.report import Reportable

RESULTS = (
    "swashplate.api.campaigns.results:Campaign",
    "swashplate.api.compare:CaseComparison",
    "swashplate.api.check_controller:ControllerCheck",
    "swashplate.api.decouple:DecouplingDesign",
    "swashplate.api.decouple_axes:AxesDecoupling",
    "swashplate.api.design_controller:ControllerDesign",
    "swashplate.api.designed_maneuver:DesignedManeuver",
    "swashplate.api.fly_maneuver:SimulatedFlight",
    "swashplate.identification.core.result:Result",
    "swashplate.api.linear_study:LinearStudy",
    "swashplate.api.monte_carlo:MonteCarlo",
    "swashplate.api.track:Tracking",
    "swashplate.identification.responses.frequency_response:FrequencyResponse",
    "swashplate.simulation.derivatives_over_speed:Derivatives",
    "swashplate.simulation.trim_curve:TrimCurve",
    "swashplate.validation.along_inputs:ModelComparison",
    "swashplate.validation.validation:Validation",
)
"""What verbs return that is worth a page."""


def _load(place: str) -> Any:
    module, _, name = place.partition(":")
    return getattr(import_module(module), name)


@pytest.mark.parametrize("name", RESULTS)
def test_a_result_prints_is_saved_and_makes_a_page(name: str) -> None:
    known = tuple(typing.get_origin(kind) or kind for kind in typing.get_args(Reportable))
    kind = _load(name)
    assert "__repr__" in vars(kind)
    assert issubclass(kind, known) or hasattr(kind, "page") or kind.__name__ in SECTIONS
    assert hasattr(kind, "to_document") or hasattr(kind, "to_document")
    assert callable(kind.save)


@pytest.mark.parametrize(
    "name",
    [
        "check_controller",
        "compare",
        "design_controller",
        "fit_ss",
        "identify",
        "monte_carlo",
        "respond",
        "simulate",
        "validate",
    ],
)
def test_a_function_is_its_question(name: str) -> None:
    """Signature and help say each field with its unit, what comes of it, and what is raised."""
    verb = getattr(sp, name)
    signature = inspect.signature(verb)
    assert verb.__name__ == name
    assert "VerbQuestion" not in str(signature.return_annotation)
    assert signature.return_annotation not in (None, "None", inspect.Signature.empty)
    told = inspect.getdoc(verb) or ""
    for field in signature.parameters:
        assert f"\n    {field}: " in told, field
    assert "\nRaises:\n    " in told
    assert pickle.loads(pickle.dumps(verb)) is verb


def test_units_and_bounds_stand_in_help_and_in_the_check() -> None:
    assert "    computation: time from a reading to its command [ms]." in sp.check_controller.__doc__
    with pytest.raises(sp.SwashError, match="computation: is -1, expected at least 0 ms"):
        sp.check_controller("coax", "c.toml", computation=-1.0)


def test_respond_takes_a_flight_at_one_rate_as_it_is_and_conditions_any_other() -> None:
    time = np.arange(0.0, 40.0, 0.02)
    command = np.sin(2.0 * np.pi * (0.2 + 0.05 * time) * time)
    answer = np.convolve(command, np.full(10, 0.1))[: time.size]
    asked = {"inputs": "mixer_roll", "outputs": "p", "band": (0.5, 3.0)}
    even = Flight({"log": stream(time, {"mixer_roll": command, "p": answer})})
    uneven = Flight({"log": stream(time + 2e-3 * np.sin(time), {"mixer_roll": command, "p": answer})})
    assert is_uniform(even, ["mixer_roll", "p"])
    assert not is_uniform(uneven, ["mixer_roll", "p"])
    assert not is_uniform(even, ["mixer_roll", "q"])
    assert [one.history for one in sp.respond(even, **asked).data] == [()]
    assert sp.respond(uneven, **asked).band("p", "mixer_roll")


def test_simulate_flies_a_maneuver_under_a_hold_or_inputs_as_they_are() -> None:
    coax = sp.vehicle("coax")
    flown = sp.simulate("coax", "doublet:roll,0.3s,0.1", lead=0.5, tail=0.5, wind=(0.2, 0.0, np.zeros(161)))
    assert flown.duration == pytest.approx(1.6)
    assert np.all(flown.values("wind_north") == 0.2)
    again = sp.simulate(coax, flown, start=dict(zip(coax.state_names, flown.array(coax.state_names)[0], strict=True)))
    assert np.abs(again.values("phi") - flown.values("phi")).max() < 1e-9, "the recorded inputs fly the same"
    heavy = sp.simulate("coax", "hover:0.2s", changes={"mass": 0.5}, lead=0.0, tail=0.0)
    assert heavy.values("motor_upper")[0] > flown.values("motor_upper")[0]


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"maneuver": "hover:1s", "start": {"phi": 0.1}}, r"start: is for inputs; here a maneuver"),
        ({"maneuver": "hover:1s", "substeps": 2}, r"substeps: is for inputs"),
        ({"maneuver": {}, "wind": (1.0, 0.0, 0.0)}, r"wind: is for a maneuver; here inputs"),
        ({"maneuver": {}, "controller": sp.hover_hold}, r"controller: is for a maneuver"),
        ({"maneuver": "hover:1s", "interpolation": "cubic"}, r"interpolation: 'cubic' is unknown"),
        ({"maneuver": "hover:1s", "lead": -1.0}, r"lead: is -1, expected at least 0 s"),
        ({"maneuver": "hover:1s", "wind": 5.0}, r"wind: is 5.0, expected three"),
        ({"maneuver": "hover:1s", "wind": (1.0, 2.0)}, r"wind: has 2 parts, expected three"),
        ({"maneuver": "hover:1s", "wind": (0.0, np.nan, 0.0)}, r"wind: towards east is not finite"),
        ({"maneuver": {}, "start": 5}, r"start: is 5, expected values by name"),
        ({"maneuver": {}, "start": {"phi": "high"}}, r"start phi: is 'high', expected a number"),
        ({"maneuver": "hover:1s", "pilot": np.ones(3)}, r"pilot: is array.*expected true or false"),
        ({"maneuver": "hover:1s", "controller": 5}, r"controller: is 5, expected a controller or its file"),
        ({"maneuver": "hover:1s", "controller": lambda vehicle, trim: 3}, r"controller: is 3, expected a controller"),
    ],
)
def test_simulate_refuses_what_suits_the_other_kind_of_flight(given: dict[str, Any], said: str) -> None:
    with pytest.raises(sp.SwashError, match=said):
        sp.simulate("coax", **given)
