"""Strings where names are meant are names, in every public function."""

from __future__ import annotations

import inspect
import pickle
import re
from collections.abc import Callable, Sequence
from pathlib import Path
from types import FunctionType
from typing import Any

import numpy as np
import pytest

import swashplate as sp
from swashplate import public
from swashplate.api.languages import language_of
from swashplate.errors import CardError
from swashplate.flights.flight import Flight, stream
from swashplate.meant import taking_names

PUBLIC = {name: thing for name in public.NAMES if inspect.isfunction(thing := getattr(sp, name))}
FUNCTIONS = {name: thing for name, thing in PUBLIC.items() if ".verbs." not in public.place(name)}
QUESTIONS = {name: thing for name, thing in PUBLIC.items() if name not in FUNCTIONS}
"""Verbs, which read texts by the languages of their fields."""
SEQUENCES = ("Sequence[str", "Iterable[str", "tuple[str, ...]")
LOADED = ("Vehicle", "Flight", "FrequencyResponse")


def arguments(kinds: Sequence[str]) -> list[tuple[str, str]]:
    """Functions with an argument whose annotation, as it is written, has one of these kinds and takes no string."""
    made = []
    for name, function in FUNCTIONS.items():
        for one in inspect.signature(function).parameters.values():
            outer = written = str(one.annotation)
            while "[" in outer and (inner := re.sub(r"\[[^\[\]]*\]", "", outer)) != outer:
                outer = inner
            if one.kind is one.VAR_POSITIONAL or "Callable" in written:
                continue
            if "str" not in re.findall(r"\w+", outer) and any(kind in written for kind in kinds):
                made.append((name, one.name))
    return made


def recorded(function: Callable[..., Any], loads: Any) -> Callable[..., dict[str, Any]]:
    """What a public function is called with: the same arguments, annotations and globals, every argument optional."""
    signature = inspect.signature(function)
    names = tuple(signature.parameters)

    def told(*args: Any, **kwargs: Any) -> dict[str, Any]:
        return {**dict(zip(names, args, strict=False)), **kwargs}

    of_it: Any = FunctionType(told.__code__, function.__globals__, "told", None, told.__closure__)
    of_it.__signature__ = signature.replace(
        parameters=[
            p if p.kind in (p.VAR_KEYWORD, p.VAR_POSITIONAL) else p.replace(default=None)
            for p in signature.parameters.values()
        ]
    )
    return taking_names(of_it, loads)


def test_there_is_something_to_walk_and_all_of_it_is_wrapped() -> None:
    assert len(FUNCTIONS) > 25
    assert len(QUESTIONS) > 19
    assert len(arguments(SEQUENCES)) > 3
    assert len(arguments(LOADED)) > 20
    assert all(hasattr(function, "__wrapped__") for function in FUNCTIONS.values())


@pytest.mark.parametrize(("name", "argument"), arguments(SEQUENCES))
def test_one_name_is_a_list_of_one(name: str, argument: str) -> None:
    called = recorded(FUNCTIONS[name].__wrapped__, {})
    assert called(**{argument: "mixer_roll"})[argument] == ("mixer_roll",), "one name, and not its letters"
    assert called(**{argument: ["p", "q"]})[argument] == ["p", "q"], "a list stays as it is"


@pytest.mark.parametrize("name", QUESTIONS)
def test_of_a_verb_every_field_has_a_language_that_reads_one_name_as_one(name: str) -> None:
    for field in inspect.signature(QUESTIONS[name]).parameters.values():
        language = language_of(str(field.annotation))
        if "Names" in str(field.annotation):
            assert language.taken("mixer_roll", called=field.name) == ("mixer_roll",)
            assert language.taken(["p", "q"], called=field.name) == ("p", "q")


@pytest.mark.parametrize(("name", "argument"), arguments(LOADED))
def test_names_and_files_are_loaded(name: str, argument: str) -> None:
    loads = {public.place(kind): (lambda text, kind=kind: (kind, text)) for kind in public._LOADED_BY}
    called = recorded(FUNCTIONS[name].__wrapped__, loads)
    for text in ("some", Path("some")):
        kind, given = called(**{argument: text})[argument]
        assert kind in inspect.signature(FUNCTIONS[name]).parameters[argument].annotation
        assert given == text


def test_as_a_user_calls_them(tmp_path: Path) -> None:
    time = np.arange(0.0, 40.0, 0.01)
    sweep = 0.1 * np.sin(2.0 * np.pi * (0.3 + 0.1 * time) * time)
    flight = Flight({"log": stream(time, {"mixer_roll": sweep, "p": np.gradient(sweep, 0.01)})})
    responses = sp.respond(flight, inputs="mixer_roll", outputs="p", band=(0.5, 8.0))
    assert (responses.inputs, responses.outputs) == (("mixer_roll",), ("p",))
    assert responses.select("p", "mixer_roll").outputs == ("p",)
    assert flight.array("p").shape == (time.size, 1)
    flight.save(tmp_path / "log.nc")
    assert sp.inspect(str(tmp_path / "log.nc")).duration == pytest.approx(39.99)
    assert sp.linearize("raptor50").inputs == sp.vehicle("raptor50").input_names
    assert sp.trim("coax").inputs == pytest.approx(sp.trim(sp.vehicle("coax")).inputs)


def test_what_is_no_name_is_said_by_whoever_reads_names() -> None:
    with pytest.raises(CardError, match="Did you mean 'raptor50'"):
        sp.linearize("raptor5")
    with pytest.raises(TypeError, match="missing 1 required positional argument: 'vehicle'"):
        sp.linearize()
    with pytest.raises(TypeError, match="unexpected keyword argument 'speed'"):
        sp.linearize("raptor50", speed="fast")
    with pytest.raises(TypeError, match=r"^trim\(\) got an unexpected keyword argument 'sped'"):
        sp.trim("raptor50", sped=3.0)


def test_a_string_that_is_meant_as_such_stays_one() -> None:
    def named(name: str, file: str | Path, tied: Sequence[str] | str, vehicle: sp.Vehicle | None = None) -> Any:
        return name, file, tied, vehicle

    called = taking_names(named, {public.place("Vehicle"): lambda text: f"vehicle {text}"})
    assert called("a", Path("b"), "c") == ("a", Path("b"), "c", None)
    assert called("a", "b", ["c"], "coax") == ("a", "b", ["c"], "vehicle coax")


def test_public_functions_are_found_again_by_pickle() -> None:
    assert pickle.loads(pickle.dumps(sp.linearize)) is sp.linearize
