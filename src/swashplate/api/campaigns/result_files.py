"""A table as the bytes of one file: Parquet, and NumPy's own archive where the library for Parquet is not installed."""

from __future__ import annotations

import io
import zipfile
from importlib.util import find_spec

import numpy as np
from numpy.typing import NDArray

from swashplate.api.campaigns.tasks import Columns
from swashplate.errors import CampaignError
from swashplate.extras import library

PARQUET, NUMPY = ".parquet", ".npz"
ENDINGS = (PARQUET, NUMPY)
"""Of files that hold a result."""
LARGEST = 2 << 30
"""Bytes of a result at most, in the file and unpacked."""


def usual_ending() -> str:
    """How a new result's file ends here."""
    return PARQUET if find_spec("pyarrow") else NUMPY


def packed(columns: Columns, *, ending: str) -> bytes:
    """The file of a table.

    The same bytes for the same table and version of the library. In Parquet no value is compressed or replaced by an
    index into a dictionary, and every page has a checksum. What is no character in a text (a byte of a log's name) is
    written as its number, `\\udcff`.

    Args:
        columns: numbers or texts, all of the same length.
        ending: one of `ENDINGS`.

    Raises:
        CampaignError: columns that are neither numbers nor texts, or not of one length.
        MissingLibraryError: for Parquet without the extra `scale`.
    """
    if others := [column for column, values in columns.items() if values.dtype.kind not in "biufU"]:
        raise CampaignError("is neither numbers nor texts.", channel=", ".join(others))
    if len({values.shape for values in columns.values()}) > 1 or any(values.ndim != 1 for values in columns.values()):
        shapes = ", ".join(f"{column} {values.shape}" for column, values in columns.items())
        raise CampaignError(f"columns of one length are expected, found {shapes}.")
    columns = {name: _characters(values) if values.dtype.kind == "U" else values for name, values in columns.items()}
    stream = io.BytesIO()
    if ending == NUMPY:
        np.savez(stream, **columns)  # pyrefly: ignore[bad-argument-type]
        return stream.getvalue()
    parquet = library("pyarrow.parquet", what="a table in Parquet")
    table = library("pyarrow", what="a table in Parquet").table(columns)
    parquet.write_table(table, stream, compression="none", use_dictionary=False, write_page_checksum=True)
    return stream.getvalue()


def unpacked(content: bytes, *, ending: str) -> Columns:
    """The table of a file; `packed` is the way back.

    Raises:
        ValueError: a file that claims more than `LARGEST`; and whatever the libraries raise on damaged bytes.
        MissingLibraryError: for Parquet without the extra `scale`.
    """
    if ending == NUMPY:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            _check(sum(entry.file_size for entry in archive.infolist()))
        with np.load(io.BytesIO(content), allow_pickle=False) as arrays:
            return {key: arrays[key] for key in arrays.files}
    parquet = library("pyarrow.parquet", what="a table in Parquet")
    with parquet.ParquetFile(io.BytesIO(content), page_checksum_verification=True) as file:
        _check(8 * file.metadata.num_rows * file.metadata.num_columns)
        table = file.read(use_threads=False)
    columns: Columns = {}
    for name, values in zip(table.column_names, table.columns, strict=True):
        values.validate(full=True)
        column = values.to_numpy()
        columns[name] = np.asarray(column, dtype=np.str_) if column.dtype == np.object_ else np.array(column)
    return columns


def _characters(texts: NDArray[np.str_]) -> NDArray[np.str_]:
    return np.array([text.encode("utf-8", "backslashreplace").decode() for text in texts.tolist()], dtype=np.str_)


def _check(size: int) -> None:
    if size > LARGEST:
        raise ValueError("it claims more than it can hold")
