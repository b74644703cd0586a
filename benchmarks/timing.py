"""How rates and durations are told; a rate is the best of several repeats, since others only ever make it slower."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import asdict, dataclass


@dataclass(frozen=True)
class Result:
    """One measured rate.

    Attributes:
        name: what ran.
        rate: vehicle steps per second.
        target: the least that is promised, if anything is.
        note: what must be known to compare it.
    """

    name: str
    rate: float
    target: float | None = None
    note: str = ""

    @property
    def met(self) -> bool:
        return self.target is None or self.rate >= self.target

    def as_json(self) -> dict[str, object]:
        return {**asdict(self), "met": self.met}


@dataclass(frozen=True)
class Span:
    """One measured duration.

    Attributes:
        name: what ran.
        seconds: how long.
        target: the most that is promised.
        note: what must be known to compare it.
        kept: other promises about the same run (memory).
    """

    name: str
    seconds: float
    target: float
    note: str = ""
    kept: bool = True

    @property
    def met(self) -> bool:
        return self.kept and self.seconds <= self.target

    def as_json(self) -> dict[str, object]:
        return {**asdict(self), "met": self.met}


def best_rate(run: Callable[[], object], steps: int, *, repeats: int) -> float:
    """Steps per second of the fastest of `repeats` calls, after one call that is not counted (compilation, caches)."""
    run()
    fastest = float("inf")
    for _ in range(repeats):
        begin = time.perf_counter()
        run()
        fastest = min(fastest, time.perf_counter() - begin)
    return steps / fastest
