"""Methods that reach a layer above them have the signature of the verb that does the work."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from typing import Any

import pytest

import swashplate as sp
from swashplate import public
from swashplate.flights.flight import Flight
from swashplate.shown import Shown

METHODS: dict[str, tuple[Callable[..., Any], Callable[..., Any]]] = {
    "Flight.condition": (Flight.condition, public.resolve("condition")),
    "Flight.to_dataframe": (Flight.to_dataframe, public.resolve("flight_to_dataframe")),
    "Shown.plot": (Shown.plot, public.resolve("plot")),
    "Shown.explore": (Shown.explore, public.resolve("explore")),
    "Flight.from_arrays": (Flight.from_arrays, public.resolve("flight_from_arrays")),
    "Flight.from_dataframe": (Flight.from_dataframe, public.resolve("flight_from_dataframe")),
}


def _plain(verb: Callable[..., Any]) -> list[tuple[str, Any, Any]]:
    """Kind and default of each argument after the first, by name."""
    return [(p.name, p.kind, p.default) for p in list(inspect.signature(verb).parameters.values())[1:]]


@pytest.mark.parametrize("name", METHODS)
def test_a_late_method_has_its_verbs_signature(name: str) -> None:
    method, verb = METHODS[name]
    assert _plain(method) == _plain(verb)


def test_another_default_would_be_seen() -> None:
    assert _plain(lambda self, *, a=1: None) != _plain(lambda self, *, a=2: None)


def test_every_name_behind_a_method_is_there() -> None:
    for name in public._BEHIND_METHODS:
        assert callable(public.resolve(name))


def test_the_tables_and_the_public_list_agree() -> None:
    assert {*public.NAMES, "__version__"} == set(sp.__all__)


def test_a_name_of_no_table_is_a_key_error() -> None:
    with pytest.raises(KeyError):
        public.resolve("nonsense")
