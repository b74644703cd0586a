"""What a result was made with, and hashes that are the same on every machine."""

from __future__ import annotations

import hashlib
import json
import os
import platform
from datetime import UTC, datetime
from typing import Any

from swashplate.extras import version_of
from swashplate.models.card import Card

_PACKAGES = ("swashplate", "casadi", "numpy", "scipy", "xarray", "plotly")


def versions() -> dict[str, str]:
    """Versions of Python and of the packages that numbers depend on."""
    return {"python": platform.python_version(), **{name: version_of(name) for name in _PACKAGES}}


def date() -> str:
    """The date in UTC; `SOURCE_DATE_EPOCH` [s] replaces the clock, so that a report can be reproduced to the byte."""
    fixed = os.environ.get("SOURCE_DATE_EPOCH", "")
    now = datetime.fromtimestamp(int(fixed), UTC) if fixed.isdigit() else datetime.now(UTC)
    return now.strftime("%Y-%m-%d %H:%M UTC")


def card_hash(card: Card) -> str:
    """SHA-256 of a card's text, without the path that it was read from."""
    return hashlib.sha256(card.to_toml().encode("utf-8", errors="replace")).hexdigest()


def result_hash(result: dict[str, Any]) -> str:
    """SHA-256 of a result's numbers and words: rounded to six digits, wall time left out.

    Two machines that agree to six digits agree on the hash (but for numbers that round differently by chance).
    """
    text = json.dumps(_rounded({k: v for k, v in result.items() if k != "seconds"}), sort_keys=True, default=str)
    return hashlib.sha256(text.encode()).hexdigest()


def _rounded(value: Any) -> Any:
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, dict):
        return {str(key): _rounded(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_rounded(item) for item in value]
    return value
