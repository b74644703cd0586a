"""Everything that is wrong with a file, said in one error: a person who mends a table wants the list, not one a run."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
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

    def refuse(self, beside: Sequence[str] = ()) -> None:
        """Raises what was gathered: a single error as it is, several as one list.

        Args:
            beside: what else was found on the way, for the end of the message.

        Raises:
            FlightError: UnitError where units are all that is wrong.
        """
        if not self.errors:
            return
        also = [f"Beside that: {'; '.join(beside)}."] if beside else []
        kind = UnitError if all(isinstance(error, UnitError) for error in self.errors) else FlightError
        if len(self.errors) == 1:
            (only,) = self.errors
            raise kind(" ".join([only.problem, *also]), where=only.where, channel=only.channel, hint=only.hint)
        places = {error.where for error in self.errors}
        place = next(iter(places)) if len(places) == 1 else self.where
        heads = [
            ": ".join(part for part in (e.where if e.where != place else "", e.channel) if part) for e in self.errors
        ]
        told = [
            f"({i}) {f'{head}: ' if head else ''}{e.problem}"
            for i, (head, e) in enumerate(zip(heads, self.errors, strict=True), 1)
        ]
        more = [f"and {len(told) - _MOST} more."] if len(told) > _MOST else []
        raise kind(
            " ".join([f"has {len(told)} faults:", *told[:_MOST], *more, *also]),
            where=place,
            hint=" ".join(dict.fromkeys(error.hint for error in self.errors if error.hint)) or None,
        )
