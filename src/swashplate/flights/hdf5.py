"""HDF5 files of others, looked through before anything in them is read.

HDF5 can say that a data set's bytes lie in any other file (external storage, virtual data sets, external links), ask
for a plugin that unpacks them, and claim sizes for which nothing was ever stored. None of our files does.
"""

from __future__ import annotations

from pathlib import Path

import h5py
import numpy as np

from swashplate.errors import FlightError
from swashplate.flights.readers.source import refuse_oversized

_OWN_FILTERS = {
    h5py.h5z.FILTER_DEFLATE,
    h5py.h5z.FILTER_SHUFFLE,
    h5py.h5z.FILTER_FLETCHER32,
    h5py.h5z.FILTER_SCALEOFFSET,
    h5py.h5z.FILTER_NBIT,
}
_DEEPEST = 8  # groups inside each other; ours have one


def check(path: Path, file: h5py.File) -> None:
    """Refuses a file that points outside of itself, needs a plugin, or claims more than it can hold.

    Raises:
        FlightError: naming the part of the file.
    """
    claimed = _claimed(path, file.id, "", set())
    refuse_oversized(claimed, size=path.stat().st_size, where=str(path), what="its data sets together")


def _claimed(path: Path, group: h5py.h5g.GroupID, name: str, seen: set[int]) -> int:
    """Bytes that the data sets of a group claim, those of the groups in it included."""
    if name.count("/") > _DEEPEST:
        raise _refused(path, name, "its groups are nested too deeply")
    claimed = 0
    for link in list(group):
        inner = f"{name}/{link.decode('utf-8', 'replace')}"
        if group.links.get_info(link).type != h5py.h5l.TYPE_HARD:
            raise _refused(path, inner, "it is a link, to another file perhaps")
        place = h5py.h5o.get_info(group, link).addr
        if place in seen:  # a group that lies within itself
            continue
        seen.add(place)
        item = h5py.h5o.open(group, link)
        if isinstance(item, h5py.h5g.GroupID):
            claimed += _claimed(path, item, inner, seen)
        elif isinstance(item, h5py.h5d.DatasetID):
            claimed += _claimed_by(path, item, inner)
    return claimed


def _claimed_by(path: Path, item: h5py.h5d.DatasetID, name: str) -> int:
    made = item.get_create_plist()
    if made.get_layout() == h5py.h5d.VIRTUAL:
        raise _refused(path, name, "it is virtual: its numbers lie in other files")
    if made.get_external_count():
        raise _refused(path, name, "its numbers lie in other files")
    for k in range(made.get_nfilters()):
        if made.get_filter(k)[0] not in _OWN_FILTERS:
            raise _refused(path, name, "it is packed by a plugin")
    _check_scales(path, item, name)
    return int(np.prod(item.shape or (), dtype=object)) * int(item.dtype.itemsize)


def _check_scales(path: Path, item: h5py.h5d.DatasetID, name: str) -> None:
    """HDF5 1.14 reads what says which axis is along which as if it were of the right type: with another one it writes
    beyond its memory, and the process dies then or later."""
    for attribute, right in _SCALES.items():
        if not h5py.h5a.exists(item, attribute):
            continue
        found = h5py.h5a.open(item, attribute)
        if not right(found.get_type()) or (attribute == b"DIMENSION_LIST" and found.shape != (item.rank,)):
            raise _refused(path, f"{name}/{attribute.decode()}", "it is not of the type that HDF5 expects")


def _lists_references(kind: h5py.h5t.TypeID) -> bool:
    return isinstance(kind, h5py.h5t.TypeVlenID) and isinstance(kind.get_super(), h5py.h5t.TypeReferenceID)


def _pairs_references(kind: h5py.h5t.TypeID) -> bool:
    """Whether it is a reference and the number of an axis."""
    if not isinstance(kind, h5py.h5t.TypeCompoundID) or kind.get_nmembers() != 2:
        return False
    first, second = kind.get_member_type(0), kind.get_member_type(1)
    return isinstance(first, h5py.h5t.TypeReferenceID) and isinstance(second, h5py.h5t.TypeIntegerID)


def _is_text(kind: h5py.h5t.TypeID) -> bool:
    return isinstance(kind, h5py.h5t.TypeStringID) and not kind.is_variable_str()


_SCALES = {
    b"DIMENSION_LIST": _lists_references,
    b"REFERENCE_LIST": _pairs_references,
    b"CLASS": _is_text,
    b"NAME": _is_text,
}


def _refused(path: Path, name: str, what: str) -> FlightError:
    return FlightError(
        f"{what}, and that is not read.",
        where=path,
        channel=name.removeprefix("/"),
        hint="No file of swashplate's is so; do not trust this one.",
    )
