"""A table in Parquet, told in frames by the process that reads it (`swashplate.flights.foreign_process`)."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from pyarrow import parquet

from swashplate.flights.foreign_process import Frame


def frames(path: Path, *, most: int) -> Iterator[Frame]:
    """A file's columns, in their order.

    Args:
        path: the file.
        most: bytes that its numbers may claim.

    Yields:
        {"column", "dtype", "bytes"} with a column's numbers, or {"column", "texts"}; then {"said": what the file says
        of itself, by name}; a frame without entries is the last one.

    Raises:
        ValueError: where it claims more, and for damaged bytes.
        Exception: whatever else the library raises on them.
    """
    with parquet.ParquetFile(path, page_checksum_verification=True) as file:
        if 8 * file.metadata.num_rows * file.metadata.num_columns > most:
            raise ValueError("it claims more than it can hold")
        table = file.read(use_threads=False)
    for name, values in zip(table.column_names, table.columns, strict=True):
        values.validate(full=True)
        column = values.to_numpy()
        if column.dtype == np.object_:
            yield {"column": name, "texts": [str(text) for text in column]}, b""
        else:
            yield {"column": name, "dtype": column.dtype.str, "bytes": column.nbytes}, column.tobytes()
    kept = table.schema.metadata or {}
    yield {"said": {name.decode(): value.decode() for name, value in kept.items()}}, b""
    yield {}, b""
