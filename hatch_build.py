"""Build hook: the live page's libraries and the commit go into wheels and source archives; a user needs no Node."""

from __future__ import annotations

import importlib.util
import os
import tempfile
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface


class PageHook(BuildHookInterface):
    """Fetches what `scripts/vendor_page.py` lists, and writes the commit; an editable installation goes without."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        if version == "editable":
            return
        self._keep_commit(build_data)
        if os.environ.get("SWASHPLATE_WITHOUT_PAGE") == "1":
            return
        page = self._module("scripts/vendor_page.py")
        if not page.current():
            try:
                page.fetch()
            except Exception as error:
                raise SystemExit(
                    f"The live page's libraries could not be fetched: {error}. Install Node's npm, or set "
                    "SWASHPLATE_WITHOUT_PAGE=1 to build without `swash live` and `swash replay`."
                ) from error

    def _keep_commit(self, build_data: dict[str, Any]) -> None:
        commit = self._module("src/swashplate/commit.py")
        if found := commit.commit_of(Path(self.root)):
            self._folder = tempfile.TemporaryDirectory()
            kept = Path(self._folder.name) / commit.BUILT
            kept.write_text(found, encoding="ascii")
            inside = "src/swashplate" if self.target_name == "sdist" else "swashplate"
            build_data["force_include"][str(kept)] = f"{inside}/{commit.BUILT}"

    def _module(self, path: str) -> Any:
        spec = importlib.util.spec_from_file_location(Path(path).stem, Path(self.root) / path)
        assert spec is not None
        assert spec.loader is not None
        made = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(made)
        return made
