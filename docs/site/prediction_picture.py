"""Still pictures of the key results for README files and papers (PNG or SVG, by the suffix of the path)."""

from __future__ import annotations

import io
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from swashplate.atomic import make_folder, write_bytes
from swashplate.errors import SwashError
from swashplate.flights.schema import channel
from swashplate.identification.time.kinematics import PREDICTED
from swashplate.reporting.figures_time import flight_name
from swashplate.reporting.sections_validation import apart
from swashplate.reporting.theme import FLIGHT, MODEL, axis_title
from swashplate.validation.validation import Validation

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def prediction_picture(
    validation: Validation,
    *,
    path: str | os.PathLike[str],
    channels: tuple[str, ...] = ("phi", "theta", "p", "q"),
    title: str | None = None,
) -> Path:
    """Flight (solid) and predictions (dashed, +-2 sigma) over time on the first predicted flight."""
    if not validation.records or not validation.examples:
        raise SwashError("the validation has no predictions to draw.")
    source = flight_name(validation.records[0].name)
    mine = [i for i, record in enumerate(validation.records) if flight_name(record.name) == source]
    names = {validation.records[i].name for i in mine}
    examples = apart([e for e in validation.examples if e.record in names])
    figure = blank_figure(8.6, 1.35 * len(channels) + 0.7)
    panels: Any = figure.subplots(len(channels), 1, sharex=True)
    for panel, name in zip(np.atleast_1d(panels), channels, strict=True):
        j, factor = PREDICTED.index(name), channel(name).shown_factor
        for k, i in enumerate(mine):
            record = validation.records[i]
            label = "flight" if k == 0 else None
            panel.plot(record.time, factor * validation.measured[i][:, j], color=FLIGHT, lw=1.0, label=label)
        for k, e in enumerate(examples):
            middle = factor * e.states[:, j]
            spread = 2.0 * factor * np.broadcast_to(e.sigma, e.states.shape)[:, j]
            label = "prediction from each dot, ±2σ" if k == 0 else None
            panel.fill_between(e.time, middle - spread, middle + spread, color=MODEL, alpha=0.2, lw=0)
            panel.plot(e.time, middle, color=MODEL, lw=1.4, ls="--", label=label)
            panel.plot(e.time[:1], middle[:1], "o", color=MODEL, ms=4)
        panel.set_ylabel(axis_title(name))
        panel.margins(x=0.01)
        tidy(panel)
    np.atleast_1d(panels)[0].legend(loc="upper right", ncols=2, frameon=False, fontsize=9)
    np.atleast_1d(panels)[-1].set_xlabel("time [s]")
    figure.suptitle(title or f"Prediction of {source}", fontsize=11, x=0.02, ha="left")
    return _save(figure, path)


def blank_figure(width: float, height: float) -> Figure:
    """A figure without a window system: nothing of pyplot's global state is touched."""
    from matplotlib.figure import Figure

    return Figure(figsize=(width, height), layout="constrained", facecolor="white")


def tidy(panel: Any) -> None:
    """A light grid, and no frame above and to the right."""
    panel.grid(color="#e4e4e4", lw=0.7)
    panel.set_axisbelow(True)
    for side in ("top", "right"):
        panel.spines[side].set_visible(False)


def _save(figure: Figure, path: str | os.PathLike[str]) -> Path:
    """Writes without a date in it, so that the same result gives the same bytes."""
    import matplotlib as mpl

    target = Path(path)
    if target.suffix not in (".png", ".svg"):
        raise SwashError(f"suffix is '{target.suffix}', expected .png or .svg.", where=target)
    make_folder(target.parent)
    stamp: dict[str, Any] = {"Date": None} if target.suffix == ".svg" else {"Software": None}
    drawn = io.BytesIO()
    with mpl.rc_context({"svg.hashsalt": "swashplate"}):
        figure.savefig(drawn, format=target.suffix[1:], dpi=160, metadata=stamp)
    return write_bytes(target, drawn.getbuffer())
