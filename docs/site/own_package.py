"""An example package as if it were installed: its modules and its entry points, for pages and tests."""

from __future__ import annotations

import shutil
import sys
import tomllib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from swashplate.control.kinds import CONTROLLERS
from swashplate.export.formats import FORMATS
from swashplate.flights.readers.read import READERS
from swashplate.identification.core.document_codec import PARTS
from swashplate.identification.estimators import ESTIMATORS
from swashplate.models.catalogue import EQUATIONS
from swashplate.registry import Registry

REGISTRIES: tuple[Registry[Any], ...] = (EQUATIONS, ESTIMATORS, READERS, CONTROLLERS, FORMATS, PARTS)
EXAMPLES = Path(__file__).resolve().parents[2] / "examples"


@contextmanager
def installed(name: str, site: Path) -> Iterator[None]:
    """`examples/NAME` with the entry points of its pyproject.toml in a folder on Python's path, then gone again."""
    project = tomllib.loads((EXAMPLES / name / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    shutil.copytree(EXAMPLES / name, site, dirs_exist_ok=True)
    about = site / f"{name}-{project['version']}.dist-info"
    about.mkdir(exist_ok=True)
    head = f"Metadata-Version: 2.1\nName: {project['name']}\nVersion: {project['version']}\n"
    (about / "METADATA").write_text(head, encoding="utf-8")
    groups = project.get("entry-points", {}).items()
    text = "\n".join(f"[{group}]\n" + "".join(f"{k} = {v}\n" for k, v in points.items()) for group, points in groups)
    (about / "entry_points.txt").write_text(text, encoding="utf-8")
    sys.path.insert(0, str(site))
    _ask_again()
    try:
        yield
    finally:
        sys.path.remove(str(site))
        sys.modules.pop(name, None)
        _ask_again()


def _ask_again() -> None:
    """Let the registries look anew: what is installed they ask once."""
    for registry in REGISTRIES:
        registry.__dict__.pop("_others", None)
