"""Build hook: the live page's libraries go into wheels and source archives, so that a user needs no Node."""

from __future__ import annotations

import importlib.util
import os
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface


class PageHook(BuildHookInterface):
    """Fetches what `scripts/vendor_page.py` lists; an editable installation (`make demo`) goes without."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        if version == "editable" or os.environ.get("SWASHPLATE_WITHOUT_PAGE") == "1":
            return
        path = Path(self.root) / "scripts" / "vendor_page.py"
        spec = importlib.util.spec_from_file_location("vendor_page", path)
        assert spec is not None
        assert spec.loader is not None
        page = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(page)
        if not page.current():
            try:
                page.fetch()
            except Exception as error:
                raise SystemExit(
                    f"The live page's libraries could not be fetched: {error}. Install Node's npm, or set "
                    "SWASHPLATE_WITHOUT_PAGE=1 to build without `swash live` and `swash replay`."
                ) from error
