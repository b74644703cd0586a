"""What a proof leaves for `docs/proof.md`."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any


def leave(name: str, found: dict[str, Any]) -> None:
    """Write a section of the page (see tests/proof.py) where `make proof` asks for it."""
    folder = os.environ.get("SWASHPLATE_PROOF")
    if folder:
        Path(folder, f"{name}.json").write_text(json.dumps(found), encoding="utf-8")
