"""Numbers as a log stores them, in 32 bits or less, which become what they stand for when they are looked at."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from xarray.backends import BackendArray
from xarray.core import indexing

from swashplate.arrays import Array


class StoredColumn(BackendArray):
    """A row of numbers: xarray asks it for those that are looked at, and so may others.

    Attributes:
        stored: as they stand in the log, shape (n,). factors: what each is multiplied by, one after the other.
    """

    def __init__(self, stored: NDArray[np.generic], *factors: float) -> None:
        self.stored, self.factors = stored, tuple(factor for factor in factors if factor != 1.0)
        self.shape, self.dtype = stored.shape, np.dtype(np.float64)

    def __getitem__(self, key: indexing.ExplicitIndexer) -> Array:
        values: Array = indexing.explicit_indexing_adapter(
            key, self.shape, indexing.IndexingSupport.OUTER_1VECTOR, self.at
        )
        return values

    @property
    def numbers(self) -> Array:
        """What they stand for; nobody can write into it, for it would be lost."""
        return self.at(slice(None))

    def at(self, chosen: Any) -> Array:
        """What some of them stand for, by slice, mask or indices."""
        stored = self.stored[chosen]
        with np.errstate(invalid="ignore"):  # damaged bytes may be a signalling NaN
            values = np.array(stored, dtype=np.float64)
        for factor in self.factors:
            values *= factor
        values.flags.writeable = False
        return values

    def times(self, factor: float) -> StoredColumn:
        """The same row for another unit."""
        return StoredColumn(self.stored, *self.factors, factor)

    @property
    def largest(self) -> float:
        """The largest size of any of them, from the stored numbers; NaN where one is NaN."""
        if not self.stored.size:
            return 0.0
        with np.errstate(invalid="ignore"):  # damaged bytes may be a signalling NaN
            ends = np.array([self.stored.min(), self.stored.max()], dtype=np.float64)
        return float(np.max(np.abs(ends)) * abs(np.prod(self.factors)))

    @classmethod
    def behind(cls, values: xr.DataArray) -> StoredColumn | None:
        """The row that a channel's numbers are made of when they are looked at; None where it has them."""
        held = values.variable._data
        if isinstance(held, indexing.LazilyIndexedArray) and isinstance(held.array, cls):
            return cls(held.array.stored[held.key.tuple], *held.array.factors)
        return None

    def timed(self, labels: Mapping[str, str]) -> xr.Variable:
        """The numbers over time with their labels."""
        return xr.Variable(("time",), indexing.LazilyIndexedArray(self), labels, fastpath=True)
