"""Strings where more is meant: a name for a list of names, a vehicle's name for the vehicle, a file for what it holds.

`public.resolve` puts `taking_names` around every public function: `sp.respond(flight, inputs="mixer_roll", ...)` takes
one channel and not ten letters, `sp.linearize("raptor50")` the vehicle of that name. What a function means by an
argument is in its annotation; where that has `str` itself, the string is the function's own business.
"""

from __future__ import annotations

import functools
import inspect
import types
import typing
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any, TypeVar, cast

Load = Callable[[str | Path], Any]
Call = TypeVar("Call", bound=Callable[..., Any])


def taking_names(function: Call, loads: Mapping[str, Load] | None = None) -> Call:
    """The function, which takes strings and paths for what its annotations mean.

    Args:
        function: a public function or method.
        loads: what makes an object of a name or a file, by the object's class as "module:class"; None for none.
    """
    known = loads or {}
    signature = inspect.signature(function)

    @functools.wraps(function)
    def called(*args: Any, **kwargs: Any) -> Any:
        if not any(_holds_text(value) for value in (*args, *kwargs.values())):
            return function(*args, **kwargs)
        try:
            bound = signature.bind(*args, **kwargs)
        except TypeError:
            return function(*args, **kwargs)  # which says itself what is missing
        for name, value in bound.arguments.items():
            if _holds_text(value):
                bound.arguments[name] = meant(value, _members(function, name), known)
        return function(*bound.args, **bound.kwargs)

    return cast(Call, called)


def meant(value: Any, members: frozenset[Any], loads: Mapping[str, Load]) -> Any:
    """A string, a path, or a list with some, as what is meant by them.

    Args:
        value: as it was given.
        members: the types that are taken.
        loads: as of `taking_names`.
    """
    one = isinstance(value, str | Path)
    plain = str in members or (isinstance(value, Path) and Path in members)
    elements = frozenset().union(*(_inside(member) for member in members))
    if plain if one else str in elements:
        return value
    if one and str in elements:
        return (value,)
    load = next((make for kind, make in loads.items() if kind in map(_place, members | elements)), None)
    if load is not None:
        return load(value) if one else tuple(load(each) if isinstance(each, str | Path) else each for each in value)
    return Path(value) if one and Path in members else value


def _holds_text(value: Any) -> bool:
    """Whether an argument is a string or a path, or a list that has some beside or instead of objects."""
    if isinstance(value, str | Path):
        return True
    return isinstance(value, list | tuple) and any(isinstance(each, str | Path) for each in value)


@functools.cache
def _members(function: Callable[..., Any], name: str) -> frozenset[Any]:
    """The types that an argument takes; none where its annotation is not known."""
    annotation = inspect.signature(function).parameters[name].annotation
    stand_in = types.SimpleNamespace(__annotations__={name: annotation})
    try:
        hint = typing.get_type_hints(stand_in, globalns=getattr(function, "__globals__", {}))[name]
    except (NameError, TypeError):
        return frozenset()
    return _flat(hint)


def _flat(hint: Any) -> frozenset[Any]:
    if typing.get_origin(hint) in (typing.Union, types.UnionType):
        return frozenset().union(*(_flat(one) for one in typing.get_args(hint)))
    return frozenset([hint])


def _inside(hint: Any) -> frozenset[Any]:
    """The types of the elements of a list."""
    origin = typing.get_origin(hint)
    if not (isinstance(origin, type) and issubclass(origin, Iterable)) or issubclass(origin, Mapping):
        return frozenset()
    return frozenset().union(*(_flat(one) for one in typing.get_args(hint)[:1]))


def _place(kind: Any) -> str:
    kind = typing.get_origin(kind) or kind
    return f"{getattr(kind, '__module__', '')}:{getattr(kind, '__qualname__', '')}"
