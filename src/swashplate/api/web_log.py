"""The format "web" of a log: the page of `swash open` as one HTML file with the log in it, to send to others."""

from __future__ import annotations

import os
from collections.abc import Callable, Collection, Mapping
from pathlib import Path

from swashplate.export.formats import Export
from swashplate.export.origin import program_and_commit
from swashplate.flights.datasets import locate
from swashplate.flights.readers.options import split_log, split_window
from swashplate.flights.readers.read import read as read_log
from swashplate.links.logs.code_lines import Read
from swashplate.links.logs.kept_mappings import kept
from swashplate.links.logs.remedies import Remedy
from swashplate.links.logs.sent_page import sent_page


def export_log(
    log: str | os.PathLike[str],
    *,
    name: str | None = None,
    keep: Collection[str] = (),
    units: Mapping[str, str] | None = None,
    mapping: str | os.PathLike[str] | None = None,
    bad_stamps: str = "error",
    say: Callable[[str], None] = lambda _: None,
) -> Export:
    """A log as one HTML file of 5 MB or less: plots, findings, review, spectra, fit, gains and their sliders.

    Args:
        log: a file, a part of it (FILE@START-STOP), one of several in it (FILE#N), or a data set's name.
        name: of the HTML file; "log" where None.
        keep: what stays of what is personal (`links.logs.personal.KINDS`).
        units, mapping, bad_stamps: as of `sp.read`; by the mapping kept for a table's columns where neither is given.
        say: hears what is being done.

    Raises:
        SwashError: where the log cannot be read or checked, or fits into no such page.
    """
    path = Path(locate(split_log(split_window(log)[0])[0]))
    mapped = mapping or (None if units else kept(path))
    flight = read_log(log, units=units, mapping=mapped, bad_stamps=bad_stamps)
    read = Read(path.name, Remedy(dict(units or {}), bad_stamps == "drop"), os.fspath(mapped) if mapped else "")
    made = f"Made by {program_and_commit()}, from a log with the SHA-256 {flight.provenance.sha256}."
    page = sent_page(flight, path, read=read, keep=keep, maker=made, say=say)
    size = f"{len(page.text.encode()) / 1e6:.1f} MB, opened by double-click."
    return Export({f"{name or 'log'}.html": page.text.encode()}, (*page.remarks, size))
