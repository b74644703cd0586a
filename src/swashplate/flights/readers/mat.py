"""MATLAB files: numbers, text, cells and structs of level 5 (versions 5 to 7.2); numbers and structs of version 7.3.

Every size that a header claims is held against the bytes there are before anything is allocated for it. That is why
this is not left to `scipy.io.loadmat`, which allocates what a header asks for (a forged one asks for 10 GB) and which a
few changed bytes can bring down with a segmentation fault (scipy 1.17).

Source: MathWorks, MAT-File Format (R2024a), chapter "Level 5 MAT-File Format".
"""

from __future__ import annotations

import math
import struct
import zlib
from dataclasses import dataclass
from typing import Any

import numpy as np

from swashplate.errors import FlightError
from swashplate.flights.readers import mat_objects
from swashplate.flights.readers.source import Source, refuse_oversized

_HEADER = 128
_COMPRESSED, _MATRIX = 15, 14
_CELL, _STRUCT, _CHAR, _OPAQUE = 1, 2, 4, 17
_OTHERS = {3: "an object", 5: "a sparse matrix", 16: "a function handle"}
_NUMERIC = range(6, 16)
_COMPLEX_FLAG = 0x0800
# Element kind -> NumPy type; 16 to 18 are UTF-8, -16 and -32.
_TYPES = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}
_TEXTS = {1: "utf-8", 2: "utf-8", 4: "utf-16", 16: "utf-8", 17: "utf-16", 18: "utf-32"}
_PLAIN = ("double", "single", "logical", *(f"{sign}int{bits}" for sign in ("", "u") for bits in (8, 16, 32, 64)))
"""Classes of version 7.3 whose data are their numbers."""
_DEEPEST = 16


def is_level_5(content: bytes) -> bool:
    """Whether the bytes start as a MATLAB level 5 file does."""
    return len(content) >= _HEADER and content[124:128] in (b"\x00\x01IM", b"\x01\x00MI")


def is_version_7_3(content: bytes) -> bool:
    """Whether the bytes start as a MATLAB 7.3 file does (which is HDF5)."""
    return content.startswith(b"MATLAB 7.3 MAT-file") or content[512:520] == b"\x89HDF\r\n\x1a\n"


class _DamagedError(Exception):
    """An element whose sizes do not fit into the bytes around it."""


@dataclass(frozen=True)
class _Element:
    kind: int
    data: memoryview
    next: int  # offset of the element after it


@dataclass(frozen=True)
class Unread:
    """A variable of a kind that is not read: what it is in words, and the class of an object, a cell or structs."""

    what: str
    kind: str = ""


def _element(data: memoryview, at: int, order: str) -> _Element:
    """The element whose tag stands at offset `at`."""
    if at + 8 > len(data):
        raise _DamagedError("an element's tag is cut off")
    kind, size = struct.unpack_from(order + "II", data, at)
    if kind >> 16:  # small element: size and kind share four bytes, data the next four
        kind, size, start, end = kind & 0xFFFF, kind >> 16, at + 4, at + 8
        if size > 4:
            raise _DamagedError(f"a small element claims {size} bytes")
    else:
        start = at + 8
        end = start + (size if kind == _COMPRESSED else -(-size // 8) * 8)
    if start + size > len(data):
        raise _DamagedError(f"an element claims {size:,} bytes where {len(data) - start:,} are left")
    return _Element(kind, data[start : start + size], min(end, len(data)))


def _inflate(data: memoryview, order: str, source: Source) -> memoryview:
    """A compressed element's content, unpacked no further than the size that its own tag claims."""
    machine = zlib.decompressobj()
    try:
        head = machine.decompress(data, 8)
        if len(head) < 8:
            raise _DamagedError("a compressed element is cut off")
        size = struct.unpack(order + "II", head)[1]
        refuse_oversized(size, size=source.size, where=source.name, what="a compressed variable")
        body = machine.decompress(machine.unconsumed_tail, size) if size else b""
    except zlib.error as error:
        raise _DamagedError(f"a compressed element does not unpack ({error})") from None
    if len(body) < size:
        raise _DamagedError(f"a compressed element claims {size:,} bytes and unpacks to {len(body):,}")
    return memoryview(head + body)


def _dimensions(element: _Element, order: str) -> tuple[int, ...]:
    if element.kind != 5 or len(element.data) % 4 or not 8 <= len(element.data) <= 128:
        raise _DamagedError("a variable has no dimensions")
    lengths: tuple[int, ...] = struct.unpack(order + f"{len(element.data) // 4}i", element.data)
    if min(lengths) < 0:
        raise _DamagedError("a variable has a negative dimension")
    return lengths


def _numbers(data: memoryview, at: int, order: str, shape: tuple[int, ...]) -> np.ndarray[Any, Any]:
    """The numbers of a real array, in MATLAB's column order, without the dimensions of length one."""
    element = _element(data, at, order) if at < len(data) else _Element(1, data[:0], at)
    if element.kind not in _TYPES:
        raise _DamagedError(f"an element of kind {element.kind} stands where numbers should")
    kind = np.dtype(order + _TYPES[element.kind])
    count, held = math.prod(shape), len(element.data) // kind.itemsize
    if count > held:
        raise _DamagedError(f"a variable claims {count:,} numbers and holds {held:,}")
    if not count:  # its other lengths may be more than NumPy's arrays can have
        return np.zeros(0, dtype=kind)
    return np.frombuffer(element.data, dtype=kind, count=count).reshape(shape, order="F").squeeze()


def _names(element: _Element, length: int) -> list[str]:
    if length < 1 or len(element.data) % length:
        raise _DamagedError("a struct has no readable field names")
    content = bytes(element.data)
    cells = (content[at : at + length] for at in range(0, len(content), length))
    return [cell.split(b"\0", 1)[0].decode("latin-1") for cell in cells]


def _variable(data: memoryview, order: str, depth: int = 0) -> tuple[str, Any]:
    """Name and value of a matrix element's content: array, text, list (cell), dict or list of dicts (struct)."""
    if not len(data):
        return "", np.zeros(0)
    if depth > _DEEPEST:
        raise _DamagedError("variables are nested too deeply")
    flags = _element(data, 0, order)
    if flags.kind != 6 or len(flags.data) < 8:
        raise _DamagedError("a variable has no array flags")
    flag = struct.unpack_from(order + "I", flags.data)[0]
    matlab_class, at = flag & 0xFF, flags.next
    if matlab_class == _OPAQUE:  # no dimensions: its name, the kind of its class and the class
        title = _element(data, at, order)
        kind = _element(data, title.next, order)
        called = bytes(_element(data, kind.next, order).data).decode("latin-1")
        return bytes(title.data).decode("latin-1"), Unread(f"a MATLAB object of class {called}", called)
    dimensions = _element(data, at, order)
    shape = _dimensions(dimensions, order)
    title = _element(data, dimensions.next, order)
    name, at = bytes(title.data).decode("latin-1"), title.next
    if matlab_class in _NUMERIC:
        return name, Unread("complex numbers") if flag & _COMPLEX_FLAG else _numbers(data, at, order, shape)
    if matlab_class == _CHAR:
        text = _element(data, at, order) if at < len(data) else _Element(1, data[:0], at)
        encoding = _TEXTS.get(text.kind, "latin-1")
        ending = "" if encoding in ("utf-8", "latin-1") else "-le" if order == "<" else "-be"
        return name, bytes(text.data).decode(encoding + ending, errors="replace")
    if matlab_class not in (_CELL, _STRUCT):
        return name, Unread(_OTHERS.get(matlab_class, f"a variable of MATLAB class {matlab_class}"))
    fields = [""]
    if matlab_class == _STRUCT:
        width = _element(data, at, order)
        titles = _element(data, width.next, order)
        fields = _names(titles, struct.unpack(order + "i", width.data)[0] if len(width.data) == 4 else 0)
        at = titles.next
    count = math.prod(shape)
    if count * max(1, len(fields)) * 8 > len(data) - at:
        raise _DamagedError(f"a variable claims {count:,} parts in {len(data) - at:,} bytes")
    parts = []
    for _ in range(count * len(fields)):
        part = _element(data, at, order)
        if part.kind != _MATRIX:
            raise _DamagedError("a part of a variable is not a variable")
        parts.append(_variable(part.data, order, depth + 1)[1])
        at = part.next
    if matlab_class == _CELL:
        return name, parts
    structs = [dict(zip(fields, parts[i * len(fields) :], strict=False)) for i in range(count)]
    return name, structs[0] if count == 1 else structs


def _variables(source: Source, order: str) -> dict[str, Any]:
    content, at, unpacked = memoryview(source.content), _HEADER, 0
    variables = {}
    while at < source.size:
        outer = _element(content, at, order)
        inner = outer
        if outer.kind == _COMPRESSED:
            inflated = _inflate(outer.data, order, source)
            inner = _element(inflated, 0, order)
            unpacked += len(inflated)
            refuse_oversized(unpacked, size=source.size, where=source.name, what="the file's variables together")
        if inner.kind != _MATRIX:
            raise _DamagedError(f"an element of kind {inner.kind} stands where a variable should")
        name, value = _variable(inner.data, order)
        variables[name] = value
        at = outer.next
    return variables


def _version_7_3(source: Source) -> dict[str, Any]:
    """The variables of a MATLAB 7.3 file, which is HDF5 with its dimensions the other way round."""
    from swashplate.flights import hdf5  # a tenth of a second that other files need not wait

    try:
        groups = hdf5.read(source.path, wanted="") or {}
    except (ValueError, KeyError, OSError) as error:
        raise FlightError(f"is a damaged MATLAB 7.3 file: {error}.", where=source.name, hint="Copy it again.") from None
    variables: dict[str, Any] = {}
    for name, group in groups.items():
        if name.startswith("#"):  # what cells and objects point to
            continue
        at = variables
        for part in filter(None, name.split("/")):
            at = at.setdefault(part, {})
        for key, stored in group.variables.items():
            kind = stored.attributes.get("MATLAB_class", "double")
            if stored.attributes.get("MATLAB_empty"):
                at[key] = np.zeros(0)
            elif stored.values.dtype.kind in "fiub" and kind in _PLAIN:
                at[key] = stored.values.T.squeeze()
            elif kind in _PLAIN:  # references: the parts stand elsewhere in the file
                at[key] = Unread("a MATLAB array of structs", mat_objects.STRUCTS)
            else:
                held = "a MATLAB cell" if kind == "cell" else f"a MATLAB object of class {kind}"
                at[key] = Unread("text") if kind == "char" else Unread(held, kind)
    return variables


def load(source: Source) -> dict[str, Any]:
    """The variables of a MATLAB file of level 5 or version 7.3 by name.

    Returns:
        Arrays (without dimensions of length one), texts, lists for cells, dictionaries for structs of one element and
        lists of them for others; `Unread` for complex numbers, sparse matrices and objects.

    Raises:
        FlightError: where it is no such file, or is damaged.
    """
    if is_version_7_3(source.content):
        return _version_7_3(source)
    if not is_level_5(source.content):
        raise FlightError(
            "is not a MATLAB .mat file: its first 128 bytes are not a level 5 header.",
            where=source.name,
            hint="Save it from MATLAB with '-v7', or give the file its own name ending (.csv, .nc).",
        )
    try:
        return _variables(source, "<" if source.content[126:128] == b"IM" else ">")
    except _DamagedError as error:
        raise FlightError(f"is a damaged .mat file: {error}.", where=source.name, hint="Copy it again.") from None


def numbers(value: Any) -> np.ndarray[Any, np.dtype[np.float64]] | None:
    """A variable as real numbers of double precision, None where it is anything else."""
    return value.astype(np.float64) if isinstance(value, np.ndarray) else None
