"""What a user can do wrong, as exceptions whose message says what was found, what was expected and what to do.

The command line turns every `SwashError` into one line on standard error and exit code 2; anything else is ours (1).
"""

from __future__ import annotations

from pathlib import Path


def _shortened(text: str, longest: int) -> str:
    """A text whose middle is left out where nobody would read it: a file's content may stand in a message."""
    return text if len(text) <= longest else f"{text[: longest // 2]} [...] {text[7 - longest // 2 :]}"


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
        place = ": ".join(_shortened(part, 250) for part in (self.where, channel) if part)
        text = f"{place}: {_shortened(problem, 800)}" if place else _shortened(problem, 800)
        super().__init__(f"{text} {_shortened(hint, 500)}" if hint else text)


class WriteError(SwashError):
    """A file or folder that cannot be written: no space, no permission, no such folder."""


class DocumentError(SwashError):
    """A TOML or JSON document that cannot be read or says something impossible."""


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


class CampaignError(SwashError):
    """A campaign whose file, store or workers do not fit together."""


class LinkError(SwashError):
    """A link to another program that cannot be opened, or a servo mapping that does not fit the vehicle."""


class MissingLibraryError(SwashError, ModuleNotFoundError):
    """A library that this installation lacks; the message has the command that installs it."""
