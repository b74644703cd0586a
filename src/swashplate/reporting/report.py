"""The public verb: a fit and a validation become a page."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path

from swashplate.identification.fit import Fit
from swashplate.reporting.compose import compose
from swashplate.reporting.html import write_page
from swashplate.simulation.linearize import Mode
from swashplate.validation.validation import Validation


def report(
    fit: Fit | None = None,
    validation: Validation | None = None,
    *,
    path: str | os.PathLike[str],
    title: str | None = None,
    modes: Mapping[str, Sequence[Mode]] | None = None,
) -> Path:
    """Write one self-contained HTML file about a fit, a validation, or both.

    The file needs no network: plotly.js and all data are in it. It appears by rename when it is complete.

    Args:
        fit: result of `swashplate.identify`.
        validation: result of `swashplate.validate`.
        path: where to write; the folder is made where it is missing.
        title: heading; made from the vehicle and the flights where None.
        modes: eigenvalues at hover by vehicle ("published", "identified"); computed where None.

    Returns:
        The file's path.

    Raises:
        SwashError: nothing to report, or a place that cannot be written to.
    """
    return write_page(path, compose(fit, validation, title=title, modes=modes))
