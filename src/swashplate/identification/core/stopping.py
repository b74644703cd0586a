"""One stop for every search: an interrupt or a polite kill ends it, and the best numbers so far are the result.

A command asks for it with `stoppable`; a verb marks the stage whose numbers are worth keeping with `kept`. Everywhere
else, and before the first iteration, an interrupt ends everything as always. A second one ends everything too.
"""

from __future__ import annotations

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, replace
from typing import TypeVar

from swashplate.identification.core.result import Result

Fit = TypeVar("Fit", bound=Result[object, object])

INTERRUPTS = (KeyboardInterrupt, SystemExit)
"""What SIGINT and, by the command line's handler, SIGTERM raise."""

RAN_OUT = "the iterations ran out."


@dataclass
class Stop:
    """Whether a command was stopped, and what it had done by then.

    Attributes:
        code: exit code, 128 and the signal's number; 0 where nothing stopped it.
        iterations: of the stage that is kept.
        keeps: whether a stop now keeps what was found.
    """

    code: int = 0
    iterations: int = 0
    keeps: bool = False

    @property
    def sentence(self) -> str:
        """What stopped it, empty where nothing did."""
        if not self.code:
            return ""
        count = f"{self.iterations} iteration{'s' if self.iterations > 1 else ''}"
        return (
            f"stopped after {count} by {signal.Signals(self.code - 128).name}: the best numbers so far, not the fit's."
        )


_STOP: ContextVar[Stop | None] = ContextVar("stop", default=None)


@contextmanager
def stoppable() -> Iterator[Stop]:
    """Within it, a stop of a kept stage keeps what was found."""
    stop = Stop()
    token = _STOP.set(stop)
    try:
        yield stop
    finally:
        _STOP.reset(token)


@contextmanager
def kept() -> Iterator[None]:
    """The stage whose best numbers are kept at a stop."""
    stop = _STOP.get()
    if stop is not None and not stop.code:  # a stage after the stopped one is done whole or not at all
        stop.keeps, stop.iterations = True, 0
    try:
        yield
    finally:
        if stop is not None:
            stop.keeps = False


def asked() -> bool:
    """Whether this stage was stopped: whoever still searches takes what there is."""
    stop = _STOP.get()
    return stop is not None and stop.keeps and stop.code != 0


def counted() -> None:
    """One more iteration is done."""
    stop = _STOP.get()
    if stop is not None and stop.keeps:
        stop.iterations += 1


def keep(interrupt: BaseException) -> None:
    """Note a stop, to go on with what was found.

    Raises:
        KeyboardInterrupt, SystemExit: the interrupt, where nothing is kept, nothing was found or it is the second.
    """
    stop = _STOP.get()
    if stop is None or not stop.keeps or not stop.iterations or stop.code:
        raise interrupt
    code = interrupt.code if isinstance(interrupt, SystemExit) else 128 + signal.SIGINT
    if not isinstance(code, int) or code not in (128 + signal.SIGINT, 128 + signal.SIGTERM):
        raise interrupt
    stop.code = code


def unfinished() -> str:
    """Why a search that has not converged ended."""
    stop = _STOP.get()
    return stop.sentence if stop is not None and stop.code else RAN_OUT


def with_stop(fit: Fit) -> Fit:
    """The fit, with the stop among its problems where there was one."""
    stop = _STOP.get()
    if stop is None or not stop.code:
        return fit
    others = tuple(text for text in fit.problems if text != stop.sentence)
    return replace(fit, converged=False, problems=(stop.sentence, *others))
