"""The file of a task's result: NumPy's archive, which names its task and has the SHA-256 of that name and the table.

A file that was copied under another task's name, or whose numbers were changed, is refused. This is against accidents
and edits, not against somebody who also computes the hash anew.
"""

from __future__ import annotations

import hashlib
import io
import json
import zipfile

import numpy as np
from numpy.typing import NDArray

from swashplate.api.campaigns.tasks import Columns
from swashplate.errors import CampaignError

ENDING = ".npz"
LARGEST = 2 << 30
"""Bytes of a result at most, in the file and unpacked."""
_TASK, _DIGEST = "swashplate.task", "swashplate.sha256"


def tabulated(columns: Columns) -> Columns:
    """Columns as a file can hold them: what is no character in a text (a byte of a log's name) is written as `\\udcff`.

    Raises:
        CampaignError: columns that are neither numbers nor texts, or not of one length.
    """
    if others := [column for column, values in columns.items() if values.dtype.kind not in "biufU"]:
        raise CampaignError("is neither numbers nor texts.", channel=", ".join(others))
    if len({values.shape for values in columns.values()}) > 1 or any(values.ndim != 1 for values in columns.values()):
        shapes = ", ".join(f"{column} {values.shape}" for column, values in columns.items())
        raise CampaignError(f"columns of one length are expected, found {shapes}.")
    return {name: _characters(values) if values.dtype.kind == "U" else values for name, values in columns.items()}


def packed(columns: Columns, *, task: str) -> bytes:
    """The file of a task's table: the same bytes for the same table and version of NumPy.

    Raises:
        CampaignError: as of `tabulated`.
    """
    columns, stream = tabulated(columns), io.BytesIO()
    np.savez(stream, **columns)  # pyrefly: ignore[bad-argument-type]
    with zipfile.ZipFile(stream, "a") as archive:
        archive.comment = json.dumps({_TASK: task, _DIGEST: digest_of_table(columns, task)}).encode()
    return stream.getvalue()


def unpacked(content: bytes, *, task: str) -> Columns:
    """The table of a task's file.

    Raises:
        ValueError: a file that claims more than `LARGEST`, a packed archive; one that is not, or no longer, the result
            of `task`; and whatever the libraries raise on damaged bytes.
    """
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        if sum(entry.file_size for entry in archive.infolist()) > LARGEST:
            raise ValueError("it claims more than it can hold")
        if any(entry.compress_type != zipfile.ZIP_STORED for entry in archive.infolist()):
            raise ValueError("it is packed, and no result is")  # it can hold a thousand times of what it weighs
        said = json.loads(archive.comment or b"{}")
    with np.load(io.BytesIO(content), allow_pickle=False) as arrays:
        columns = {key: arrays[key] for key in arrays.files}
    if _TASK not in said or _DIGEST not in said:
        raise ValueError("it does not say whose result it is")
    if said[_TASK] != task:
        raise ValueError(f"it is the result of another task, {said[_TASK][:16]}")
    if digest_of_table(columns, task) != said[_DIGEST]:
        raise ValueError("its values are not those that were computed")
    return columns


def digest_of_table(columns: Columns, task: str) -> str:
    """SHA-256 of a task's name and its columns."""
    digest = hashlib.sha256(task.encode())
    for name, values in columns.items():
        text = values.dtype.kind == "U"
        kind = "text" if text else values.dtype.newbyteorder("<").str
        digest.update(json.dumps([name, kind, len(values)]).encode())
        digest.update(json.dumps(values.tolist()).encode() if text else values.astype(kind, copy=False).tobytes())
    return digest.hexdigest()


def _characters(texts: NDArray[np.str_]) -> NDArray[np.str_]:
    return np.array([text.encode("utf-8", "backslashreplace").decode() for text in texts.tolist()], dtype=np.str_)
