"""Which of its own parameters a record asks a model to change, and whether that matters.

Behind the noise filter a right model's errors are white, and one whose parameters are off by d has S d besides, S what
they do to its predictions. Bounds say how large d may be. Of one parameter, the others free within their bounds, least
squares over all records, outputs and bands at once tell the change that the records ask for and how sure it is. An
error that hides below what noise allows in every single band does not hide from that.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from swashplate.arrays import Array, Complex
from swashplate.validation.noise_filter import INDEPENDENT


@dataclass(frozen=True)
class AskedChange:
    """A parameter that the records want elsewhere.

    Attributes:
        name, value, wanted: of the parameter, and what the records ask for instead.
        sigmas: how far apart, in standard deviations of its bound and of what the records tell, together.
        share: of what the controls do that the change moves, in the band and output where it moves most.
    """

    name: str
    value: float
    wanted: float
    sigmas: float
    share: float

    @property
    def summary_text(self) -> str:
        return (
            f"{self.name} = {self.value:.4g}, and the records ask for {self.wanted:.4g}, {self.sigmas:.0f} standard "
            f"deviations away; that moves up to {100.0 * self.share:.0f} % of what the controls do."
        )


class ParameterErrors:
    """What records tell of a model's parameters, gathered record by record in units of their bounds."""

    def __init__(self, count: int) -> None:
        self.information, self.pull = np.zeros((count, count)), np.zeros(count)

    def add(self, slopes: Complex, error: Complex, used: NDArray[np.bool_]) -> None:
        """Lines of one record, each of noise of size one.

        Args:
            moved: what one bound of each parameter does (n, k, p). error: of the predictions (n, k).
            used: which lines (n, k).
        """
        s, e = slopes[used], error[used]
        self.information += 2.0 * INDEPENDENT * np.real(s.conj().T @ s)
        self.pull += 2.0 * INDEPENDENT * np.real(s.conj().T @ e)

    def asked(self) -> tuple[Array, Array]:
        """Change of every parameter that the records ask for, and its standard deviation, in bounds."""
        change, spread = np.zeros(self.pull.size), np.full(self.pull.size, np.inf)
        for i in range(self.pull.size):
            rest = np.arange(self.pull.size) != i
            beside = np.linalg.solve(
                self.information[np.ix_(rest, rest)] + np.eye(rest.sum()), self.information[rest, i]
            )
            remaining = self.information[i, i] - self.information[i, rest] @ beside
            if remaining > 1e-9 * max(self.information[i, i], 1e-300):
                change[i] = (self.pull[i] - self.pull[rest] @ beside) / remaining
                spread[i] = 1.0 / np.sqrt(remaining)
        return change, spread
