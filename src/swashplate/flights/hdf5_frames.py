"""What is in an HDF5 file, told in frames by the process that reads it (`foreign_process`).

HDF5 can say that a data set's bytes lie in any other file (external storage, virtual data sets, external links), ask
for a plugin that unpacks them, and claim sizes for which nothing was ever stored. None of our files does, and a file
is looked through for it before anything in it is read.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from swashplate.errors import FlightError
from swashplate.flights.foreign_process import Frame
from swashplate.flights.readers.source import refuse_oversized

_OWN_FILTERS = {
    h5py.h5z.FILTER_DEFLATE,
    h5py.h5z.FILTER_SHUFFLE,
    h5py.h5z.FILTER_FLETCHER32,
    h5py.h5z.FILTER_SCALEOFFSET,
    h5py.h5z.FILTER_NBIT,
}
_DEEPEST = 8  # groups inside each other; ours have one
_OF_NETCDF = {"REFERENCE_LIST", "CLASS", "DIMENSION_LIST", "NAME", "_Netcdf4Dimid", "_Netcdf4Coordinates"}
_OF_NETCDF |= {"_NCProperties", "_nc3_strict"}


def frames(path: Path, *, wanted: str) -> Iterator[Frame]:
    """A file's groups and what is in them; a frame without entries is the last one.

    Args:
        path: the file.
        wanted: an attribute of the root; without it {"foreign": True} is all that is told. With "" any file is told,
            and what is neither numbers nor texts is told as the text of its type.

    Yields:
        {"group": name, "attributes": {...}} before the variables of a group ("" is the root), and for each of those
        {"variable", "attributes", "shape", "dtype", "bytes"} with its numbers in their order, or "texts" for them.

    Raises:
        FlightError: where the file points outside of itself, needs a plugin, or claims more than it can hold.
        Exception: whatever the library raises on damaged bytes.
    """
    with h5py.File(path, "r") as file:
        if wanted and wanted not in file.attrs:
            yield {"foreign": True}, b""
            return
        claimed = _claimed(path, file.id, "", set())
        refuse_oversized(claimed, size=path.stat().st_size, where=str(path), what="its data sets together")
        yield from _group(path, file, "", set(), strict=bool(wanted))
    yield {}, b""


def _group(path: Path, group: h5py.Group, name: str, visited: set[int], *, strict: bool) -> Iterator[Frame]:
    yield {"group": name, "attributes": _attributes(group)}, b""
    inner: list[tuple[str, h5py.Group]] = []
    for key in group:
        place = h5py.h5o.get_info(group.id, key.encode("utf-8", "surrogateescape")).addr
        if place in visited:
            continue
        visited.add(place)
        item = group[key]
        if isinstance(item, h5py.Group):
            inner.append((f"{name}/{key}".removeprefix("/"), item))
        elif isinstance(item, h5py.Dataset):
            yield _variable(path, key, item, strict=strict)
    for below, item in inner:
        yield from _group(path, item, below, visited, strict=strict)


def _variable(path: Path, name: str, item: h5py.Dataset, *, strict: bool) -> Frame:
    head: dict[str, Any] = {"variable": name, "attributes": _attributes(item), "shape": item.shape}
    if h5py.check_string_dtype(item.dtype) is not None:
        return head | {"texts": [_json_value(text) for text in np.ravel(item.asstr(errors="replace")[()])]}, b""
    if item.dtype.kind not in "fiub" and not strict:  # a cell's references, a compound: named, not read
        return head | {"shape": (1,), "texts": [str(item.dtype)]}, b""
    if item.dtype.kind not in "fiub" or item.shape is None:
        raise FlightError(f"has the type {item.dtype}, expected numbers or texts.", where=path, channel=item.name[1:])
    values = np.ascontiguousarray(item[()])
    if head["attributes"].get("dtype") == "bool":  # netCDF knows none: they are written as bytes
        values, _ = values.astype(bool), head["attributes"].pop("dtype")
    return head | {"dtype": values.dtype.str, "bytes": values.nbytes}, values.tobytes()


def _attributes(of: h5py.Group | h5py.Dataset) -> dict[str, Any]:
    return {name: _json_value(of.attrs[name]) for name in of.attrs if name not in _OF_NETCDF}


def _json_value(value: Any) -> Any:
    """A number, text or list of them as JSON has it; a list of one as its entry, as netCDF writes single numbers."""
    if isinstance(value, bytes):
        return value.decode("utf-8", "replace")
    if isinstance(value, np.ndarray):
        entries = [_json_value(entry) for entry in value.ravel().tolist()]
        return entries[0] if len(entries) == 1 else entries
    if isinstance(value, np.generic):
        return _json_value(value.item())
    return value if isinstance(value, str | int | float | bool) else str(value)


# ---- what is refused before it is read ----------------------------------------------------------------------------
def _claimed(path: Path, group: h5py.h5g.GroupID, name: str, visited: set[int]) -> int:
    """Bytes that the data sets of a group claim, those of the groups in it included."""
    if name.count("/") > _DEEPEST:
        raise _refused(path, name, "its groups are nested too deeply")
    claimed = 0
    for link in list(group):
        inner = f"{name}/{link.decode('utf-8', 'replace')}"
        if group.links.get_info(link).type != h5py.h5l.TYPE_HARD:
            raise _refused(path, inner, "it is a link, to another file perhaps")
        place = h5py.h5o.get_info(group, link).addr
        if place in visited:  # a group that lies within itself
            continue
        visited.add(place)
        item = h5py.h5o.open(group, link)
        if isinstance(item, h5py.h5g.GroupID):
            claimed += _claimed(path, item, inner, visited)
        elif isinstance(item, h5py.h5d.DatasetID):
            claimed += _claimed_by(path, item, inner)
    return claimed


def _claimed_by(path: Path, item: h5py.h5d.DatasetID, name: str) -> int:
    creation = item.get_create_plist()
    if creation.get_layout() == h5py.h5d.VIRTUAL:
        raise _refused(path, name, "it is virtual: its numbers lie in other files")
    if creation.get_external_count():
        raise _refused(path, name, "its numbers lie in other files")
    for k in range(creation.get_nfilters()):
        if creation.get_filter(k)[0] not in _OWN_FILTERS:
            raise _refused(path, name, "it is packed by a plugin")
    return int(np.prod(item.shape or (), dtype=object)) * int(item.dtype.itemsize)


def _refused(path: Path, name: str, what: str) -> FlightError:
    return FlightError(
        f"{what}, and that is not read.",
        where=path,
        channel=name.removeprefix("/"),
        hint="No file of swashplate's is so; do not trust this one.",
    )
