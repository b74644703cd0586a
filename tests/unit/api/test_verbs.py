"""What the command line does has a name in `swashplate`, and gives back what prints, is saved and makes a page."""

from __future__ import annotations

import inspect
import types
import typing
from collections.abc import Iterator, Mapping
from typing import Any

import click
import pytest
import typer
from typer.main import get_command

import swashplate as sp
from swashplate.cli.app import app
from swashplate.reporting.figures.sections import SECTIONS
from swashplate.reporting.report import HasPage, Reportable

NAMES: Mapping[str, tuple[str, ...]] = {
    "bench evaluate": ("evaluate_bench",),
    "bench plan": ("plan_bench",),
    "bench simulate": ("simulate_bench",),
    "campaign replay": ("replay_campaign",),
    "campaign report": ("campaign_results", "report"),
    "campaign resume": ("resume_campaign",),
    "campaign run": ("campaign", "plan_campaign"),
    "campaign status": ("campaign_results",),
    "control check": ("check_controller",),
    "control decouple": ("decouple", "decouple_axes"),
    "control design": ("design_controller",),
    "control gains": ("autopilot_gains",),
    "control monte-carlo": ("monte_carlo",),
    "data fetch": ("fetch_dataset",),
    "data list": ("datasets",),
    "export": ("export_model", "export_controller"),
    "identify": ("identify_and_validate", "identify", "fit_tf", "fit_ss", "fit_time"),
    "inspect": ("inspect", "plot_logs", "rotor_speed", "reconstruct"),
    "link ardupilot": ("link_ardupilot",),
    "link accept": ("accept_autopilot",),
    "link check": ("check_autopilot",),
    "link parameters": ("write_ardupilot_parameters",),
    "link px4": ("link_px4",),
    "live": ("live", "replay", "show_replay"),
    "maneuver check": ("plan_maneuver", "maneuver"),
    "maneuver design": ("design_maneuver",),
    "maneuver need": ("needed_excitation",),
    "open": ("open_logs",),
    "respond": ("respond", "uniform_records", "combine"),
    "simulate": ("fly_maneuver",),
    "track": ("track", "recursive_estimator"),
    "validate": ("validate", "validate_linear"),
    "vehicle derivatives": ("derivatives", "compare_derivatives", "omit_derivatives"),
    "vehicle linearize": ("linearize", "in_form"),
    "vehicle list": ("vehicles",),
    "vehicle new": ("new_card",),
    "vehicle show": ("vehicle",),
    "vehicle stitch": ("stitch",),
    "vehicle structures": ("structures", "show_structure", "structure"),
    "vehicle trim": ("trim", "trim_curve"),
}
"""Names of `swashplate` by verb, where a verb has another name there or several."""

STUDIES = (
    "campaign", "campaign_results", "check_controller", "combine", "compare", "decouple", "decouple_axes", "demo",
    "derivatives", "design_controller", "evaluate_bench", "fit_ss", "fit_tf", "fit_time", "fly_maneuver",
    "identify_and_validate", "monte_carlo", "respond", "resume_campaign", "track",
    "trim_curve", "validate_linear",
)  # fmt: skip
"""Verbs whose result is worth a page."""


def _verbs(group: Any, before: str = "") -> Iterator[str]:
    for name, command in group.commands.items():
        if isinstance(command, click.Group) or hasattr(command, "commands"):
            yield from _verbs(command, f"{before}{name} ")
        else:
            yield f"{before}{name}"


VERBS = sorted(_verbs(get_command(app)))


def _missing(verb: str) -> list[str]:
    return [name for name in NAMES.get(verb, (verb.replace("-", "_"),)) if name not in sp.__all__]


@pytest.mark.parametrize("verb", VERBS)
def test_every_verb_has_its_name_in_python(verb: str) -> None:
    assert _missing(verb) == [], "give it a name in `swashplate` (public.py), and in NAMES where it is another one"


def test_a_verb_without_a_name_is_found() -> None:
    fresh = typer.Typer()
    fresh.command("fit-nothing")(lambda: None)
    fresh.command("inspect")(lambda: None)
    assert [verb for verb in _verbs(get_command(fresh)) if _missing(verb)] == ["fit-nothing"]


def test_no_name_is_of_a_verb_that_has_gone() -> None:
    assert sorted(set(NAMES) - set(VERBS)) == []


def _returned(verb: Any) -> list[type]:
    """The classes that a function says it returns."""
    found = typing.get_type_hints(verb)["return"]
    kinds = typing.get_args(found) if isinstance(found, types.UnionType) else (found,)
    return [typing.get_origin(kind) or kind for kind in kinds]


@pytest.mark.parametrize("name", STUDIES)
def test_its_result_prints_is_saved_and_makes_a_page(name: str) -> None:
    known = tuple(typing.get_origin(kind) or kind for kind in typing.get_args(Reportable))
    for kind in _returned(getattr(sp, name)):
        assert "__repr__" in vars(kind)
        assert issubclass(kind, known) or hasattr(kind, "page") or kind.__name__ in SECTIONS
        assert hasattr(kind, "to_document") or hasattr(kind, "as_dict")
        assert callable(kind.save)


def test_a_result_without_a_page_is_found() -> None:
    def verb() -> inspect.Signature: ...

    assert not any(hasattr(kind, "page") for kind in _returned(verb))
    assert HasPage in HasPage.__mro__
