"""Data beside the model that was fitted to them: what every kind of fit shows of itself."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Protocol

import numpy as np

from swashplate.arrays import Array
from swashplate.identification.core.records import Record


class Compared(Protocol):
    """One piece of data beside the model."""

    @property
    def name(self) -> str:
        """The record, or the response as "output / input"."""
        ...

    @property
    def residuals(self) -> Array:
        """Data less model: (n, n_outputs) of a record; dB and degrees (n, 2) of a response."""
        ...


@dataclass(frozen=True)
class Comparison:
    """Flight and model over one record used for the fit.

    Attributes:
        record: the record.
        counted: which samples the cost counted, shape (n,).
        model: model outputs, shape (n, n_outputs): one-step predictions (of a filter) or simulation.
        sigma: standard deviation of the model's output error, shape (n_outputs,).
        states: estimated body states (n, 12) in the order x y z u v w phi theta psi p q r; (n, 0) where the method
            does not tell.
    """

    kind: ClassVar[str] = "record"
    record: Record
    counted: Array
    model: Array
    sigma: Array
    states: Array

    @property
    def name(self) -> str:
        return self.record.name

    @property
    def residuals(self) -> Array:
        return np.asarray(self.record.outputs - self.model, dtype=np.float64)
