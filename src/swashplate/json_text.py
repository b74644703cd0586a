"""Results as the text of a JSON document."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from typing import Any


def plain(value: Any) -> Any:
    """A value as JSON types: arrays as lists, and null for what JSON has no word for (NaN, infinity)."""
    if isinstance(value, Mapping):
        return {str(key): plain(entry) for key, entry in value.items()}
    if isinstance(value, str | bool | int) or value is None:
        return value
    if isinstance(value, float):
        return float(value) if math.isfinite(value) else None
    if hasattr(value, "tolist"):  # arrays and their numbers
        return plain(value.tolist())
    if isinstance(value, list | tuple | set | frozenset):
        return [plain(entry) for entry in value]
    return str(value)


def as_json(value: Any) -> str:
    """A value as the text of a JSON document, valid everywhere (RFC 8259: no NaN)."""
    return json.dumps(plain(value), indent=2, allow_nan=False, ensure_ascii=False)
