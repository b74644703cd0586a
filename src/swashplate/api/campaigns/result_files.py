"""A table as the bytes of one file: Parquet, and NumPy's own archive where the library for Parquet is not installed.

The file of a task's result names its task, and has the SHA-256 of that name and the table: a file that was copied under
another task's name, or whose numbers were changed, is refused. This is against accidents and edits, not against
somebody who also computes the hash anew.
"""

from __future__ import annotations

import hashlib
import io
import json
import zipfile
from collections.abc import Mapping
from importlib.util import find_spec
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from swashplate.api.campaigns.tasks import Columns
from swashplate.errors import CampaignError
from swashplate.extras import library, missing
from swashplate.flights import foreign

PARQUET, NUMPY = ".parquet", ".npz"
_TASK, _DIGEST = "swashplate.task", "swashplate.sha256"
ENDINGS = (PARQUET, NUMPY)
"""Of files that hold a result."""
LARGEST = 2 << 30
"""Bytes of a result at most, in the file and unpacked."""


def usual_ending() -> str:
    """How a new result's file ends here."""
    return PARQUET if find_spec("pyarrow") else NUMPY


def packed(columns: Columns, *, ending: str, task: str = "") -> bytes:
    """The file of a table.

    The same bytes for the same table and version of the library. In Parquet no value is compressed or replaced by an
    index into a dictionary, and every page has a checksum. What is no character in a text (a byte of a log's name) is
    written as its number, `\\udcff`.

    Args:
        columns: numbers or texts, all of the same length.
        ending: one of `ENDINGS`.
        task: whose result it is; "" for a table that is none's.

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
    stream, mark = io.BytesIO(), _mark(columns, task) if task else {}
    if ending == NUMPY:
        np.savez(stream, **columns)  # pyrefly: ignore[bad-argument-type]
        with zipfile.ZipFile(stream, "a") as archive:
            archive.comment = json.dumps(mark).encode()
        return stream.getvalue()
    parquet = library("pyarrow.parquet", what="a table in Parquet")
    table = library("pyarrow", what="a table in Parquet").table(columns).replace_schema_metadata(mark)
    parquet.write_table(table, stream, compression="none", use_dictionary=False, write_page_checksum=True)
    return stream.getvalue()


def unpacked(path: Path, content: bytes, *, task: str = "") -> Columns:
    """The table of a file of these bytes; `packed` is the way back, with the arguments.

    Parquet is read in the process with limits (`flights.foreign`): its library aborts on some forged columns.

    Raises:
        ValueError: a file that claims more than `LARGEST`, a packed archive; one that is not, or no longer, the result
            of `task`; and whatever the libraries raise on damaged bytes.
        FlightError: for a limit that was met, or a library that ended its process.
        MissingLibraryError: for Parquet without the extra `scale`.
    """
    if path.suffix == NUMPY:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            _check(sum(entry.file_size for entry in archive.infolist()))
            if any(entry.compress_type != zipfile.ZIP_STORED for entry in archive.infolist()):
                raise ValueError("it is packed, and no result is")  # it can hold a thousand times of what it weighs
            comment = archive.comment
        with np.load(io.BytesIO(content), allow_pickle=False) as arrays:
            return _checked({key: arrays[key] for key in arrays.files}, json.loads(comment or b"{}"), task)
    if not find_spec("pyarrow"):
        raise missing("pyarrow", what="a table in Parquet")
    columns: Columns = {}
    said: Mapping[str, str] = {}
    for told, values in foreign.frames("parquet", path, size=len(content), most=LARGEST):
        if "texts" in told:
            columns[told["column"]] = np.array(told["texts"], dtype=np.str_)
        elif "column" in told:
            columns[told["column"]] = np.frombuffer(values, told["dtype"])
        said = told.get("said", said)
    return _checked(columns, said, task)


def _mark(columns: Columns, task: str) -> dict[str, str]:
    """What a file says of itself: its task, and the SHA-256 of its task's name and its columns."""
    digest = hashlib.sha256(task.encode())
    for name, values in columns.items():
        text = values.dtype.kind == "U"
        kind = "text" if text else values.dtype.newbyteorder("<").str
        digest.update(json.dumps([name, kind, len(values)]).encode())
        digest.update(json.dumps(values.tolist()).encode() if text else values.astype(kind, copy=False).tobytes())
    return {_TASK: task, _DIGEST: digest.hexdigest()}


def _checked(columns: Columns, said: Mapping[str, str], task: str) -> Columns:
    if task:
        if _TASK not in said or _DIGEST not in said:
            raise ValueError("it does not say whose result it is")
        if said[_TASK] != task:
            raise ValueError(f"it is the result of another task, {said[_TASK][:16]}")
        if _mark(columns, task)[_DIGEST] != said[_DIGEST]:
            raise ValueError("its values are not those that were computed")
    return columns


def _characters(texts: NDArray[np.str_]) -> NDArray[np.str_]:
    return np.array([text.encode("utf-8", "backslashreplace").decode() for text in texts.tolist()], dtype=np.str_)


def _check(size: int) -> None:
    if size > LARGEST:
        raise ValueError("it claims more than it can hold")
