"""A report's structure as one self-contained HTML page: no network, everything that comes from files escaped."""

from __future__ import annotations

import json
import os
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Any

from jinja2 import Environment, StrictUndefined
from markupsafe import Markup

from swashplate.atomic import make_folder, write_text
from swashplate.reporting.structure import Figure, Report


def render(report: Report) -> str:
    """The page. Figures are data that one small script hands to plotly; words from files can only become text."""
    template = _environment().from_string(_read("template.html.j2"))
    return template.render(
        report=report,
        figures=[(figure.identifier, _safe_json(figure)) for figure in report.figures],
        style=Markup(_read("page.css")),
        script=Markup(_read("page.js")),
        plotly=Markup(_plotly()),
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


@cache
def _plotly() -> str:
    """plotly.js, with what could end a script element taken out of it."""
    from plotly.offline import get_plotlyjs

    return str(get_plotlyjs()).replace("</script", "<\\/script")


def _safe_json(figure: Figure) -> Markup:
    """A figure as JSON that can stand in a script element: no "<", ">" or "&" is left in it.

    plotly reads a few tags in its texts (<b>, <br>, <a>), so text from files is made harmless there as well.
    """
    text = json.dumps(_without_tags(figure.spec), separators=(",", ":"), allow_nan=False, ensure_ascii=True)
    for sign, code in (("<", "\\u003c"), (">", "\\u003e"), ("&", "\\u0026")):
        text = text.replace(sign, code)
    return Markup(text)


_OURS = ("<br>", "<b>", "</b>", "<extra></extra>")


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
