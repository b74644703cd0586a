"""Every object that shows itself: all of its figures, in every theme, with a name and a unit on every axis."""

from __future__ import annotations

import ast
import inspect
import json
import re
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any, get_args, get_origin, get_type_hints

import numpy as np
import pytest

import swashplate as sp
from report_samples import fit, flight, modes, validation
from shown_results import MAKE, autopilot, responses, sweep
from swashplate.errors import SwashError
from swashplate.extras import library
from swashplate.public import place
from swashplate.reporting.compose import compose
from swashplate.reporting.figures import of_flight
from swashplate.reporting.figures.still import still
from swashplate.reporting.figures.themes import DARK
from swashplate.reporting.figures.views import figures_of, interactive
from swashplate.reporting.structure import Figure, Key
from swashplate.reporting.theme import axis, base_layout, line
from swashplate.simulation.linearize import LinearModel
from swashplate.simulation.trim_curve import trim_curve

_WAYS = ("plot", "explore", "_repr_html_", "save")
_UNIT = re.compile(r"\[[^\]]+\]")


def _study() -> Any:
    return sp.fit_tf(responses(), input="servo_roll", outputs=["p"], form="0/1")


def _linear() -> LinearModel:
    a, none = np.array([[0.0, 1.0], [-4.0, -0.4]]), np.zeros((2, 1))
    trim = sp.trim(sp.vehicle("coax"))
    return LinearModel(a, np.array([[0.0], [1.0]]), np.eye(2), none, none, ("x", "u"), ("push",), ("wind",), trim)


def _spectra() -> dict[str, Figure]:
    flown = flight(8.0)
    drawn = [
        of_flight.over_time([flown, sweep()], channels=["p", "q"], shifts=(0.0, 1.0)),
        of_flight.spectrum([flown, sweep()], channels=["p"]),
        of_flight.spectrogram(flown, channels=["p", "servo_roll"]),
    ]
    return {figure.identifier: figure for figure in drawn}


MADE: dict[str, Callable[[], dict[str, Figure]]] = {
    "flight": lambda: figures_of(flight(5.0)),
    "inspection": lambda: figures_of(sp.inspect(flight(5.0))),
    "responses": lambda: figures_of(responses()),
    "transfer function": lambda: figures_of(
        sp.fit_transfer_function(responses(), "0/1", input="servo_roll", outputs=["p"])
    ),
    "study of transfer functions": lambda: figures_of(_study()),
    "linear model": lambda: figures_of(_linear()),
    "trims": lambda: figures_of(trim_curve(sp.vehicle("coax"), (0.0,))),
    "fit and validation": lambda: {f.identifier: f for f in compose(fit(), validation(), modes=modes()).figures},
    "spectra": _spectra,
    **{name: (lambda make=make: figures_of(make())) for name, make in MAKE.items()},
}

WITHOUT = {
    "Autopilot": "a law; `check_controller` shows what it is worth",
    "CampaignPlan": "cost and size in words",
    "Controller": "a law; `check_controller` shows what it is worth",
    "Export": "files",
    "Hold": "a law; `check_controller` shows what it is worth",
    "Margins": "two numbers",
    "StateHold": "a law; `check_controller` shows what it is worth",
    "TransferFunctionDetails": "the result shows them",
    "TransferFunctions": "the result shows it",
    "NeededExcitation": "a handful of numbers",
    "Trim": "one point's numbers; `trim_curve` shows many",
    "Vehicle": "`trim_curve`, `derivatives` and `linearize` show what it does",
}
"""What the verbs return that does not show itself, and why."""


def _answers(name: str) -> list[type]:
    """The classes of ours in what a verb says it returns, which its module imports for type checkers only."""
    (module, _, _), found = place(name).partition(":"), []
    told = re.findall(r"\w+", str(inspect.signature(getattr(sp, name)).return_annotation))
    for node in ast.walk(ast.parse(Path(str(import_module(module).__file__)).read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and node.module:
            found += [(node.module, alias) for alias in node.names if (alias.asname or alias.name) in told]
    return [getattr(import_module(where), alias.name) for where, alias in found]


def _returned() -> dict[str, type]:
    """Every class of ours that a public verb returns, by its name."""
    found: dict[str, type] = {}
    for name in sp.__all__:
        verb = getattr(sp, name)
        if not inspect.isfunction(verb):
            continue
        try:
            wanted = get_type_hints(verb).get("return")
        except NameError:  # a name that is imported for type checkers only
            continue
        asked = _answers(name) if ".verbs." in place(name) else ()
        inside = (part for each in get_args(wanted) for part in get_args(each))
        for kind in (*asked, wanted, *get_args(wanted), *inside):
            kind = get_origin(kind) or kind
            ours = inspect.isclass(kind) and not issubclass(kind, Exception)
            if ours and kind.__module__.startswith("swashplate"):
                found[kind.__name__] = kind
    return found


def test_what_a_verb_returns_shows_itself_or_has_a_reason() -> None:
    returned = _returned()
    shown = {name for name, kind in returned.items() if all(hasattr(kind, way) for way in _WAYS)}
    assert {"Result", "Validation", "Flight", "ControllerCheck", "AutopilotGains", "Harmonics"} <= shown
    assert set(returned) - shown == set(WITHOUT)


def test_what_has_no_curve_says_so_and_still_shows_its_words(tmp_path: Any) -> None:
    check = autopilot()
    assert "it refuses to arm." in sp.report(check, path=tmp_path / "check.html").read_text(encoding="utf-8")
    assert "it refuses to arm." in check._repr_html_()
    with pytest.raises(SwashError, match="has nothing to draw"):
        check.plot()


@pytest.mark.parametrize("what", ["inspection", "spectrogram", "harmonics", "reconstruction", "equation error"])
def test_what_shows_itself_makes_a_page_and_is_saved(what: str, tmp_path: Any) -> None:
    shown = sp.inspect(flight(5.0)) if what == "inspection" else MAKE[what]()
    page = sp.report(shown, path=tmp_path / "page.html").read_text(encoding="utf-8")
    assert all(f'id="{name}"' in page for name in figures_of(shown))
    assert json.loads(shown.save(tmp_path / "numbers.json").read_text(encoding="utf-8"))


def test_what_no_page_can_show_is_refused_by_its_name(tmp_path: Any) -> None:
    with pytest.raises(SwashError, match="Card: has nothing that a page could show"):
        sp.report(sp.vehicle("coax").card, path=tmp_path / "page.html")


def test_what_an_identifying_verb_returns_stands_for_its_fit() -> None:
    study, flown = _study(), sweep()
    assert "<img" in study._repr_html_()
    assert study.model.to_control(pade=1).ninputs == 1
    alone = sp.compare(study.fit, flown)
    for found in (sp.compare(study, flown), sp.compare([study], flown)):
        assert found.fits() == alone.fits()
        assert list(found.fits()["p"]) == ["transfer functions"]
    assert sp.residuals(study, flown).samples == sp.residuals(study.fit, flown).samples
    assert sp.validate(study, flown).outputs == sp.validate(study.fit, flown).outputs
    both = sp.compare({"one": study, "other": study.fit})
    assert "one" in str(both)


def nameless(drawn: Any) -> list[str]:
    """Axes of a matplotlib figure that say neither what they show nor in which unit."""
    found = []
    for panel in drawn.axes:
        title = panel.get_title(loc="left")
        column = [p for p in drawn.axes if abs(p.get_position().x0 - panel.get_position().x0) < 0.02]
        row = [p for p in drawn.axes if abs(p.get_position().y0 - panel.get_position().y0) < 0.02]
        words = {
            "x": [p.get_xlabel() for p in column] + [title],
            "y": [p.get_ylabel() for p in row] + [title],
        }
        names = {"x": panel.get_xticklabels(), "y": panel.get_yticklabels()}
        for side, said in words.items():
            if side == "x" and panel.get_label() == "<colorbar>":
                continue
            of_names = any(re.match(r"[a-z]", label.get_text()) for label in names[side])
            if not of_names and not any(_UNIT.search(each) for each in said):
                found.append(f"{side} of '{title or panel.get_ylabel()}'")
    return found


SLOW = ("fit and validation", "study of transfer functions")
"""Many panels, which the others and the pages' own tests show too."""


@pytest.mark.parametrize("what", [pytest.param(w, marks=pytest.mark.proof) if w in SLOW else w for w in MADE])
def test_every_axis_says_what_it_shows_and_in_which_unit(what: str) -> None:
    figures = MADE[what]()
    assert figures
    for name, figure in figures.items():
        drawn = still([figure])
        assert drawn.axes, name
        assert nameless(drawn) == [], name
        assert any(panel.lines or panel.patches or panel.images or panel.collections for panel in drawn.axes), name
        explored = interactive(figure, theme="dark")
        drawn_there = [
            trace for trace in explored.data if trace.x is None or len(trace.x) != 1 or trace.x[0] is not None
        ]
        assert len(drawn_there) == len(figure.spec["data"]), "what one library draws the other draws"


def test_an_axis_without_a_unit_would_be_found() -> None:
    layout = base_layout(200)
    layout["xaxis"], layout["yaxis"] = axis("time [s]"), axis("speed")
    bare = Figure("bare", {"data": [line([0, 1], [1, 2], name="u", color="#000000")], "layout": layout}, "", "")
    drawn = still([bare])
    assert nameless(drawn) == ["y of 'speed'"]


def test_a_file_of_every_kind_is_written(tmp_path: Any) -> None:
    drawn = flight(2.0).plot(channels=["phi"], theme="dark")
    for suffix, head in (("pdf", b"%PDF"), ("svg", b"<?xml"), ("png", b"\x89PNG")):
        drawn.savefig(tmp_path / f"a.{suffix}")
        assert (tmp_path / f"a.{suffix}").read_bytes().startswith(head)


def test_dark_figures_have_no_colour_of_the_light_ones() -> None:
    drawn = still(list(figures_of(validation()).values())[:1], theme="dark")
    assert drawn.get_facecolor()[:3] == pytest.approx([0x15 / 255, 0x19 / 255, 0x1E / 255])
    explored = interactive(next(iter(figures_of(flight(2.0)).values())), theme="dark").to_json()
    found = [color for color in DARK if f'"{color}"' in explored]
    assert found == []


def test_what_there_is_not_is_refused_by_name() -> None:
    found = sp.inspect(flight(2.0))
    with pytest.raises(SwashError, match=r"no figure of it; there are recorded\. Did you mean 'recorded'"):
        found.plot("recorder")
    with pytest.raises(SwashError, match="expected one of paper, light, dark"):
        found.plot(theme="sepia")  # type: ignore[arg-type]
    with pytest.raises(SwashError, match="expected Hz or rad/s"):
        found.plot(frequency="rpm")  # type: ignore[arg-type]
    with pytest.raises(SwashError, match="pip install no_such_library"):
        library("no_such_library.part")


def test_the_key_names_what_is_drawn() -> None:
    explored = interactive(next(iter(figures_of(validation()).values())), title="<b>x</b>")
    assert next(trace.name for trace in explored.data if trace.showlegend) == "identified model"
    assert explored.layout.title.text == "‹b>x‹/b>"
    layout = base_layout(200)
    layout["xaxis"], layout["yaxis"] = axis("time [s]"), axis("u [m/s]")
    figure = Figure("a", {"data": [], "layout": layout}, "", "", keys=(Key("band", "rgba(0,0,0,0.15)", "band"),))
    assert [text.get_text() for text in still([figure]).legends[0].texts] == ["band"]
