"""How a rate is measured: the best of several repeats, since other programs only ever make it slower."""

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


def best_rate(run: Callable[[], object], steps: int, *, repeats: int) -> float:
    """Steps per second of the fastest of `repeats` calls, after one call that is not counted (compilation, caches)."""
    run()
    fastest = float("inf")
    for _ in range(repeats):
        begin = time.perf_counter()
        run()
        fastest = min(fastest, time.perf_counter() - begin)
    return steps / fastest
