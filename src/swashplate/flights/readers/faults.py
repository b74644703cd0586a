"""Everything that is wrong with a file, said in one error: a person who mends a table wants the list, not one a run."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from swashplate.errors import FlightError, UnitError

_MOST = 20
"""Faults that are listed; the rest is counted."""


class Faults:
    """Errors of one file, gathered until `refuse` is asked.

    Args:
        where: the file.
    """

    def __init__(self, where: str) -> None:
        self.where = where
        self.errors: list[FlightError] = []

    @contextmanager
    def gathered(self) -> Iterator[None]:
        """Keeps a FlightError that is raised inside; what comes next goes on without what it was about."""
        try:
            yield
        except FlightError as error:
            self.errors.append(error)

    def add(self, error: FlightError) -> None:
        self.errors.append(error)

    def refuse(self) -> None:
        """Raises what was gathered: a single error as it is, several as one list.

        Raises:
            FlightError: UnitError where units are all that is wrong.
        """
        if len(self.errors) == 1:
            raise self.errors[0]
        if not self.errors:
            return
        told = [f"({i}) {f'{e.channel}: ' if e.channel else ''}{e.problem}" for i, e in enumerate(self.errors, 1)]
        more = [f"and {len(told) - _MOST} more."] if len(told) > _MOST else []
        kind = UnitError if all(isinstance(error, UnitError) for error in self.errors) else FlightError
        places = {error.where for error in self.errors}
        raise kind(
            " ".join([f"has {len(told)} faults:", *told[:_MOST], *more]),
            where=places.pop() if len(places) == 1 else self.where,
            hint=" ".join(dict.fromkeys(error.hint for error in self.errors if error.hint)) or None,
        )
