"""Numbers as a log stores them, in 32 bits or less, which become what they stand for when they are looked at."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from xarray.backends import BackendArray
from xarray.core import indexing

from swashplate.arrays import Array


class StoredColumn(BackendArray):
    """A row of numbers: xarray asks it for those that are looked at.

    Attributes:
        stored: as they stand in the log, shape (n,). factors: what each is multiplied by, one after the other.
    """

    def __init__(self, stored: NDArray[np.generic], *factors: float) -> None:
        self.stored, self.factors = stored, tuple(factor for factor in factors if factor != 1.0)
        self.shape, self.dtype = stored.shape, np.dtype(np.float64)

    def __getitem__(self, key: indexing.ExplicitIndexer) -> Array:
        values: Array = indexing.explicit_indexing_adapter(
            key, self.shape, indexing.IndexingSupport.OUTER_1VECTOR, lambda chosen: self._numbers(self.stored[chosen])
        )
        return values

    @property
    def numbers(self) -> Array:
        """What they stand for; nobody can write into it, for it would be lost."""
        return self._numbers(self.stored)

    def _numbers(self, stored: NDArray[np.generic]) -> Array:
        with np.errstate(invalid="ignore"):  # damaged bytes may be a signalling NaN
            values = np.array(stored, dtype=np.float64)
        for factor in self.factors:
            values *= factor
        values.flags.writeable = False
        return values

    def timed(self, labels: Mapping[str, str]) -> xr.Variable:
        """The numbers over time with their labels."""
        return xr.Variable(("time",), indexing.LazilyIndexedArray(self), labels, fastpath=True)
