"""What a user can do wrong, as exceptions whose message says what was found, what was expected and what to do.

The command line turns every `SwashError` into one line on standard error and exit code 2; anything else is ours (1).
"""

from __future__ import annotations

from pathlib import Path


class SwashError(Exception):
    """Base of every error that a user's input can cause.

    Args:
        problem: one sentence: what was found and what was expected.
        where: the file the problem lies in, if any.
        channel: the channel, parameter or key it lies in, if any.
        hint: what to do about it.
    """

    def __init__(
        self,
        problem: str,
        *,
        where: str | Path | None = None,
        channel: str | None = None,
        hint: str | None = None,
    ) -> None:
        self.problem = problem
        self.where = None if where is None else str(where)
        self.channel = channel
        self.hint = hint
        place = ": ".join(part for part in (self.where, channel) if part)
        text = f"{place}: {problem}" if place else problem
        super().__init__(f"{text} {hint}" if hint else text)


class FlightError(SwashError):
    """A flight log that cannot be read, or a flight that lacks what was asked of it."""


class UnitError(FlightError):
    """A channel whose unit is missing or is not the one that the schema asks for."""


class DatasetError(SwashError):
    """A public data set that is not known, not found, or whose hash differs."""


class CardError(SwashError):
    """A parameter card with a missing, unknown or impossible entry."""


class ExpressionError(SwashError):
    """A tie between parameters that does not parse."""


class ManeuverError(SwashError):
    """A maneuver whose description does not parse or breaks its design rules."""


class TrimError(SwashError):
    """An equilibrium that does not exist, with the limit that prevents it."""


class ControllerError(SwashError):
    """A controller that cannot be designed, read or used."""


class DivergenceError(SwashError):
    """A simulation that left the finite numbers.

    Attributes:
        time: the last finite time [s].
        state: the state that went first.
        flight: the `Flight` up to there (None where none was recorded).
    """

    def __init__(self, problem: str, *, time: float, state: str, flight: object | None = None) -> None:
        self.time = time
        self.state = state
        self.flight = flight
        super().__init__(problem, channel=state)


class IdentificationError(SwashError):
    """A fit that cannot be started, or that ended at values which physics forbids."""


class BenchError(SwashError):
    """A bench record that cannot be read, or that contradicts what its procedure measures."""


class ExportError(SwashError):
    """A model that a format cannot hold, or a tool that writing it needs and that is not here."""


class LinkError(SwashError):
    """A link to another program that cannot be opened, or a servo mapping that does not fit the vehicle."""
