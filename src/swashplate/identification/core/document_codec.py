"""Dataclasses as JSON types and back, told by their annotations; every number returns exactly as it was.

NaN is null, infinities are words. Small arrays are lists of numbers that a reader can read; long ones are packed (the
bytes of little-endian doubles, zlib, base64), which keeps hours of flight exact and within what a document may have.
"""

from __future__ import annotations

import base64
import math
import types
import typing
import zlib
from collections.abc import Mapping
from dataclasses import MISSING, fields, is_dataclass
from functools import lru_cache
from typing import Any, Union

import numpy as np

from swashplate.arrays import Array, Complex
from swashplate.errors import DocumentError
from swashplate.registry import Registry

PARTS: Registry[type] = Registry(
    "result_parts",
    what="part of a result",
    own={
        "record": "swashplate.identification.core.records:Comparison",
        "response": "swashplate.identification.frequency.response_cost:ResponseComparison",
        "flight": "swashplate.identification.time.feedback:FlightDetails",
        "records in time": "swashplate.identification.time.record_fit:TimeDetails",
        "state-space responses": "swashplate.identification.frequency.state_space_result:StateSpaceDetails",
        "transfer functions": "swashplate.identification.frequency.transfer_function_fit:TransferFunctionDetails",
        "bench": "swashplate.bench.result:BenchDetails",
    },
)
"""Classes that stand for themselves in a document, by their `kind`: comparisons, and what only one method has."""

_READABLE = 4096
"""Numbers of an array that is written as lists."""
_CHUNK = 150_000
"""Characters of one packed text."""
_MOST = 200 << 20
"""Bytes of one unpacked array."""
_INFINITE = {"inf": math.inf, "-inf": -math.inf}


def encode(value: object) -> Any:
    """A value as JSON types."""
    if value is None or isinstance(value, str | bool | int):
        return value
    if isinstance(value, float):
        return float(value) if math.isfinite(value) else None if math.isnan(value) else f"{value}"
    if isinstance(value, complex):
        return {"real": encode(value.real), "imag": encode(value.imag)}
    if hasattr(value, "tolist"):  # arrays and numbers of NumPy and JAX
        array = np.asarray(value)
        return _array(array) if array.ndim else encode(array.item())
    if isinstance(value, Mapping):
        return {str(key): encode(entry) for key, entry in value.items()}
    if hasattr(value, "_asdict"):
        return {key: encode(entry) for key, entry in value._asdict().items()}
    if is_dataclass(value) and not isinstance(value, type):
        kind = getattr(type(value), "kind", None)
        return ({"kind": kind} if kind else {}) | {f.name: encode(getattr(value, f.name)) for f in fields(value)}
    if isinstance(value, list | tuple | set | frozenset):
        return [encode(entry) for entry in value]
    return str(value)


def _array(values: Array | Complex) -> Any:
    if np.iscomplexobj(values):
        return {"real": _array(values.real), "imag": _array(values.imag)}
    values = np.asarray(values, dtype="<f8")
    if 0 < values.size <= _READABLE:
        return encode(values.tolist())
    text = base64.b64encode(zlib.compress(values.tobytes(), 6)).decode()
    return {"shape": list(values.shape), "packed": [text[i : i + _CHUNK] for i in range(0, len(text), _CHUNK)]}


def decode(wanted: Any, value: object, *, where: str, at: str = "") -> Any:
    """What `encode` made of an object of that type.

    Args:
        wanted: a type or annotation.
        value: JSON types.
        where: the file; at: the entry, for messages.

    Raises:
        DocumentError: naming the entry that is missing, unknown or of another type.
    """
    origin, parts = typing.get_origin(wanted), typing.get_args(wanted)
    if wanted is Any or isinstance(wanted, typing.TypeVar):
        return value
    if origin in (Union, types.UnionType):
        if value is None and type(None) in parts:
            return None
        return decode(next(p for p in parts if p is not type(None)), value, where=where, at=at)
    if wanted is float:
        return _decoded_float(value, where, at)
    if wanted in (str, int, bool):
        if type(value) is not wanted:
            raise _wrong(value, {str: "a text", int: "a whole number", bool: "true or false"}[wanted], where, at)
        return value
    if wanted is complex:
        pair = _table(value, where, at)
        return complex(*(_decoded_float(pair.get(k, 0.0), where, f"{at}.{k}") for k in ("real", "imag")))
    if origin is np.ndarray or wanted is np.ndarray:
        return _decoded_array(value, where, at, complex_numbers="complex" in str(parts[1:]))
    if origin is tuple:
        rows = _list(value, where, at)
        kinds = [parts[0]] * len(rows) if parts[1:] == (Ellipsis,) else list(parts)
        if len(kinds) != len(rows):
            raise _wrong(value, f"a list of {len(kinds)}", where, at)
        return tuple(
            decode(k, row, where=where, at=f"{at}[{i}]") for i, (k, row) in enumerate(zip(kinds, rows, strict=True))
        )
    if origin is not None and issubclass(origin, Mapping):
        return {k: decode(parts[1], v, where=where, at=f"{at}.{k}") for k, v in _table(value, where, at).items()}
    if hasattr(wanted, "_fields"):
        return wanted(**{k: _decoded_float(v, where, f"{at}.{k}") for k, v in _known(wanted._fields, value, where, at)})
    if getattr(wanted, "_is_protocol", False):
        return part(value, where=where, at=at)
    return _decoded_object(wanted, value, where, at)


def part(value: object, *, where: str, at: str) -> Any:
    """An object whose class its `kind` names (see `PARTS`).

    Raises:
        DocumentError: for a kind that is not known.
    """
    table = _table(value, where, at)
    kind = table.get("kind")
    if not isinstance(kind, str) or kind not in PARTS:
        raise DocumentError(f"is {kind!r}, expected one of {', '.join(PARTS)}.", where=where, channel=f"{at}.kind")
    return _decoded_object(PARTS[kind], {k: v for k, v in table.items() if k != "kind"}, where, at)


@lru_cache(maxsize=64)
def _hints(wanted: type) -> dict[str, Any]:
    return typing.get_type_hints(wanted)


def _decoded_object(wanted: type, value: object, where: str, at: str) -> Any:
    hints, entries = _hints(wanted), {}
    known = {f.name: f for f in fields(wanted)}
    for name, entry in _known(tuple(known), value, where, at):
        entries[name] = decode(hints[name], entry, where=where, at=f"{at}.{name}")
    for name, entry_field in known.items():
        if name not in entries and entry_field.default is MISSING and entry_field.default_factory is MISSING:
            raise DocumentError("is missing.", where=where, channel=f"{at}.{name}")
    try:
        return wanted(**entries)
    except (TypeError, ValueError) as trouble:
        raise DocumentError(f"is no {wanted.__name__}: {trouble}.", where=where, channel=at) from None


def _known(names: tuple[str, ...], value: object, where: str, at: str) -> list[tuple[str, Any]]:
    table = _table(value, where, at)
    for name in table:
        if name not in names:
            raise DocumentError("is not known here.", where=where, channel=f"{at}.{name[:60]}")
    return list(table.items())


def _decoded_float(value: object, where: str, at: str) -> float:
    if value is None:
        return math.nan
    if isinstance(value, str) and value in _INFINITE:
        return _INFINITE[value]
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise _wrong(value, "a number", where, at)
    return float(value)


def _decoded_array(value: object, where: str, at: str, *, complex_numbers: bool) -> Any:
    if isinstance(value, dict) and set(value) == {"real", "imag"}:
        real, imag = (_decoded_array(value[k], where, f"{at}.{k}", complex_numbers=False) for k in ("real", "imag"))
        if real.shape != imag.shape:
            raise DocumentError("has parts of different shapes.", where=where, channel=at)
        return real + 1j * imag
    array = _unpacked(value, where, at) if isinstance(value, dict) else _nested(value, where, at)
    return array.astype(np.complex128) if complex_numbers else array


def _nested(value: object, where: str, at: str) -> Any:
    def numbers(entry: object, place: str, depth: int) -> Any:
        if isinstance(entry, list) and depth < 4:
            return [numbers(e, f"{place}[{i}]", depth + 1) for i, e in enumerate(entry)]
        return _decoded_float(entry, where, place)

    try:
        return np.array(numbers(_list(value, where, at), at, 0), dtype=np.float64)
    except ValueError:
        raise DocumentError("has rows of different lengths.", where=where, channel=at) from None


def _unpacked(value: dict[str, Any], where: str, at: str) -> Any:
    shape, texts = value.get("shape"), value.get("packed")
    if not (
        isinstance(shape, list)
        and all(type(n) is int and 0 <= n < 1 << 40 for n in shape)
        and isinstance(texts, list)
        and all(isinstance(t, str) for t in texts)
        and 8 * math.prod(shape) <= _MOST
    ):
        raise _wrong(value, "an array (shape, packed)", where, at)
    size = 8 * math.prod(shape)
    try:
        content = zlib.decompressobj().decompress(base64.b64decode("".join(texts), validate=True), size + 1)
    except (ValueError, zlib.error) as trouble:
        raise DocumentError(f"cannot be unpacked: {trouble}.", where=where, channel=at) from None
    if len(content) != size:
        raise DocumentError(f"has {len(content)} bytes of {size}.", where=where, channel=at)
    return np.frombuffer(content, dtype="<f8").astype(np.float64).reshape(shape)


def _table(value: object, where: str, at: str) -> dict[str, Any]:
    if not isinstance(value, dict):
        raise _wrong(value, "a table", where, at)
    return value


def _list(value: object, where: str, at: str) -> list[Any]:
    if not isinstance(value, list):
        raise _wrong(value, "a list", where, at)
    return value


def _wrong(value: object, expected: str, where: str, at: str) -> DocumentError:
    names: dict[type, str] = {
        dict: "a table",
        list: "a list",
        str: "a text",
        bool: "true or false",
        type(None): "nothing",
    }
    return DocumentError(f"is {names.get(type(value), 'a number')}, expected {expected}.", where=where, channel=at)
