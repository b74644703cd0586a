"""Named things that the package offers and that other packages may add (models, estimators, readers, exports ...).

A registry knows where each thing is ("module:attribute", or "module" where that is the thing) and loads it when it is
asked for, so that naming one imports nothing. Another package adds one by a Python entry point of the group
`swashplate.GROUP`:

    [project.entry-points."swashplate.models"]
    glider = "my_package.glider:glider"
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from difflib import get_close_matches
from functools import cached_property
from importlib import import_module
from importlib.metadata import EntryPoint, entry_points
from typing import Any, Generic, TypeVar

from swashplate.errors import SwashError

Thing = TypeVar("Thing")


def nearest(name: str, names: Iterable[str]) -> str:
    """A question after the name that one which is none of them may stand for; "" where none is like it."""
    near = get_close_matches(name, list(names), n=1)
    return f"Did you mean '{near[0]}'?" if near else ""


def listed(names: Iterable[str], *, most: int = 12) -> str:
    """Names for a message: the first so many, and how many more there are; "nothing" where there are none."""
    every = list(names)
    shown = ", ".join(every[:most]) or "nothing"
    return shown if len(every) <= most else f"{shown} and {len(every) - most} more"


class Registry(Generic[Thing]):
    """Things of one kind by name, our own and those of other packages.

    Args:
        group: of the entry points, after "swashplate.".
        what: one of them in words, for messages ("a kind of model").
        own: name and "module:attribute" (or "module") of what the package itself has.
    """

    def __init__(self, group: str, *, what: str, own: Mapping[str, str]) -> None:
        self.group, self.what = group, what
        self._own = dict(own)

    @cached_property
    def _others(self) -> Mapping[str, EntryPoint]:
        return {point.name: point for point in entry_points(group=f"swashplate.{self.group}")}

    def __iter__(self) -> Iterator[str]:
        return iter((*self._own, *(name for name in self._others if name not in self._own)))

    def __contains__(self, name: object) -> bool:
        return name in self._own or name in self._others

    def __getitem__(self, name: str) -> Thing:
        """The thing of that name.

        Raises:
            SwashError: where there is none, with the nearest names; or where another package's cannot be loaded.
        """
        if name in self._own:
            module, _, attribute = self._own[name].partition(":")
            home: Any = import_module(module)
            thing: Thing = getattr(home, attribute) if attribute else home
            return thing
        if name not in self._others:
            raise SwashError(
                f"is no {self.what}; expected one of {', '.join(self)}.", channel=name, hint=nearest(name, self)
            )
        point = self._others[name]
        try:
            loaded: Thing = point.load()
        except Exception as error:  # whatever another package's import raises
            origin = f" of {point.dist.name}" if point.dist is not None else ""
            raise SwashError(
                f"cannot be loaded from {point.value}{origin}: {type(error).__name__}: {error}.",
                channel=name,
                hint=f"It is an entry point of the group swashplate.{self.group}: mend or remove that package.",
            ) from error
        return loaded
