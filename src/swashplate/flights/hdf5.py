"""HDF5 files, read in the process for what is foreign (`foreign`)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from swashplate.flights import foreign


@dataclass(frozen=True)
class StoredVariable:
    """A data set.

    Attributes:
        values: its numbers or texts, in its own type and shape.
        attributes: its numbers and texts; lists where there are several.
    """

    values: NDArray[Any]
    attributes: Mapping[str, Any]


@dataclass(frozen=True)
class Group:
    """A group's attributes and data sets; the groups in it are told by their own names."""

    attributes: Mapping[str, Any]
    variables: dict[str, StoredVariable] = field(default_factory=dict)


def read(path: Path, *, wanted: str) -> dict[str, Group] | None:
    """All of a file: its groups by name, "" the root.

    Args:
        path: the file.
        wanted: an attribute of the root; "" for any file.

    Returns:
        None where it has no such attribute: it is no file of ours, and nothing more of it is read.

    Raises:
        FlightError: where the file points outside of itself, needs a plugin, claims more than it can hold, or where the
            library ends its process or comes to no end.
        ValueError: for damaged bytes, in the library's words.
    """
    groups: dict[str, Group] = {}
    for head, content in foreign.frames("hdf5", path, size=path.stat().st_size, wanted=wanted):
        if "foreign" in head:
            return None
        if "group" in head:
            at = groups.setdefault(head["group"], Group(head["attributes"]))
        elif head:
            kind = np.dtype(object) if "texts" in head else np.dtype(head["dtype"])
            flat = np.array(head["texts"], kind) if "texts" in head else np.frombuffer(content, kind)
            at.variables[head["variable"]] = StoredVariable(flat.reshape(head["shape"]), head["attributes"])
    return groups
