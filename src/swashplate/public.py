"""The public names, and the one place where a lower layer reaches a higher one: by name, when it is used.

`Flight.condition`, `.plot` and the like are verbs of layers above `Flight`. Importing those would make a circle, so
such a method calls `resolve("condition")`, and the verb's module is loaded then. Rules for them:

* the method has the verb's own signature, written out (`tests/unit/test_public.py` compares the two);
* it does nothing but call the verb;
* the name stands in one of the tables below.
"""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable, Mapping
from functools import cache, partial
from importlib import import_module
from pathlib import Path
from typing import Any

from swashplate.errors import MissingLibraryError
from swashplate.extras import EXTRA_OF, missing
from swashplate.meant import taking_names

_IMPORT = re.compile(r"^from (?P<module>\S+) import (?P<name>\w+) as (?P=name)$", re.MULTILINE)
_VERBS: Mapping[str, str] = {
    line["name"]: f"{line['module']}:{line['name']}"
    for line in _IMPORT.finditer(Path(__file__).with_name("__init__.pyi").read_text(encoding="utf-8"))
}
"""What `swashplate` offers by name, the version besides."""

_BEHIND_METHODS: Mapping[str, str] = {
    "condition": "swashplate.flights.conditioning.condition:condition",
    "flight_from_arrays": "swashplate.flights.tabular:from_arrays",
    "flight_from_dataframe": "swashplate.flights.tabular:from_dataframe",
    "flight_to_dataframe": "swashplate.flights.tabular:to_dataframe",
    "encode": "swashplate.identification.core.document_codec:encode",
    "FitTransferFunctions": "swashplate.api.verbs.identify:FitTransferFunctions",
    "explore": "swashplate.reporting.figures.views:explore",
    "compose_speeds": "swashplate.reporting.speed_page:compose_speeds",
    "figure_names": "swashplate.reporting.figures.views:figure_names",
    "html_of": "swashplate.reporting.figures.notebook:html_of",
    "plot": "swashplate.reporting.figures.views:plot",
    "result_from_document": "swashplate.identification.core.result_file:from_document",
    "result_to_document": "swashplate.identification.core.result_file:to_document",
    "vehicle_of_result": "swashplate.identification.frequency.transfer_function_fit:vehicle_of",
    "save_result": "swashplate.identification.core.result_file:save",
}
"""Verbs that are reached as methods (`flight.condition(...)`) and have no name in `swashplate`."""

NAMES = tuple(sorted(_VERBS))


def place(name: str) -> str:
    """Where a name of the tables is defined, as "package.module:name".

    Raises:
        KeyError: where no table has the name.
    """
    return {**_BEHIND_METHODS, **_VERBS}[name]


def _load(where: str) -> Any:
    module, _, attribute = where.partition(":")
    return getattr(import_module(module), attribute)


@cache
def _taking_names(name: str, function: Callable[..., Any]) -> Callable[..., Any]:
    """A public function that takes a vehicle's name, a file or one channel's name for what is meant by it."""
    loads = {place(kind): partial(_loaded, verb) for kind, verb in _LOADED_BY.items()}
    made = taking_names(function, loads)
    if name in NAMES:  # where pickle finds it again
        made.__module__, made.__qualname__ = __package__ or "swashplate", name
    return made


def _loaded(verb: str, given: str | Path) -> Any:
    return _load(place(verb))(given)


_LOADED_BY: Mapping[str, str] = {"Vehicle": "vehicle", "Flight": "read", "FrequencyResponse": "load", "Result": "load"}
"""What makes an object of a name or a file, where a function takes the object."""


def resolve(name: str) -> Any:
    """What a name of the tables stands for; its module is loaded now.

    Raises:
        KeyError: where no table has the name.
        MissingLibraryError: where it computes with a library that is not installed, with the command.
    """
    try:
        named = _load(place(name))
        asks = getattr(named, "__module__", "") == __package__  # a question, whose own fields take texts
        return _taking_names(name, named) if inspect.isfunction(named) and not asks else named
    except ModuleNotFoundError as error:
        if isinstance(error, MissingLibraryError) or (error.name or "").partition(".")[0] not in EXTRA_OF:
            raise
        raise missing(str(error.name), what=f"'{name}'") from None
