"""What a verb returns that fills a folder: a page, and files beside it."""

from __future__ import annotations

import os
from abc import ABC, abstractmethod
from pathlib import Path
from typing import ClassVar

from swashplate import atomic
from swashplate.reporting.html import write_page
from swashplate.reporting.structure import Report
from swashplate.shown import Shown


class ReportFolder(Shown, ABC):
    """A result with a report and files of its own.

    Attributes:
        files: what `save` may write.
    """

    files: ClassVar[tuple[str, ...]] = ("report.html",)

    @abstractmethod
    def page(self, *, title: str | None = None) -> Report:
        """What `sp.report` writes."""

    def write(self, folder: Path) -> None:
        """The files of `save` into a folder that is there."""
        write_page(folder / "report.html", self.page())

    def save(self, folder: str | os.PathLike[str]) -> Path:
        """Write `files`, as far as there is something to say in each, into a folder: all of them or none."""
        with atomic.folder_when_complete(folder, ours=self.files) as place:
            self.write(place)
        return Path(folder)
