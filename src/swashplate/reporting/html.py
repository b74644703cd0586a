"""A report's structure as one self-contained HTML page: no network, everything that comes from files escaped."""

from __future__ import annotations

import json
import os
from dataclasses import replace
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Any

from jinja2 import Environment, StrictUndefined
from markupsafe import Markup

from swashplate.atomic import make_folder, write_text
from swashplate.reporting.figures.themes import DARK
from swashplate.reporting.packing import figures_text, plotly_script
from swashplate.reporting.structure import Report


def render(report: Report) -> str:
    """The page. Figures are data that one small script hands to plotly; words from files can only become text."""
    template = _environment().from_string(_read("template.html.j2"))
    return template.render(
        report=report,
        figures=Markup(figures_text([replace(figure, spec=_without_tags(figure.spec)) for figure in report.figures])),
        style=Markup(_read("page.css")),
        script=Markup(_read("page.js")),
        plotly=Markup(plotly_script()),
        dark=Markup(json.dumps(dict(DARK))),
        over_frequency=any("frequency" in figure.spec["layout"].get("meta", {}) for figure in report.figures),
    )


def write_page(path: str | os.PathLike[str], report: Report) -> Path:
    """Write a report as a page; missing folders above it are made.

    Raises:
        WriteError: where the place cannot be written to.
    """
    make_folder(Path(path).parent)
    return write_text(path, render(report))


@cache
def _environment() -> Environment:
    return Environment(autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True)


def _read(name: str) -> str:
    return (resources.files("swashplate.reporting") / name).read_text(encoding="utf-8")


_OURS = ("<br>", "<b>", "</b>", "<extra></extra>")
"""plotly reads a few tags in its texts, so text from files is made harmless there as well."""


def _without_tags(value: Any) -> Any:
    """The same with every "<" in its strings turned into "‹", except in the tags that this package writes itself."""
    if isinstance(value, str):
        if "<" not in value:
            return value
        for place, tag in enumerate(_OURS):
            value = value.replace(tag, f"\x00{place}\x00")
        value = value.replace("<", "‹")
        for place, tag in enumerate(_OURS):
            value = value.replace(f"\x00{place}\x00", tag)
        return value
    if isinstance(value, dict):
        return {key: _without_tags(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_without_tags(item) for item in value]
    return value
