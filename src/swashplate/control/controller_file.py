"""Controllers as files: `kind = "controller"`, and a `type`, which says who of `swashplate.control.kinds` reads it."""

from __future__ import annotations

from pathlib import Path

import tomli_w

from swashplate import documents
from swashplate.atomic import write_text
from swashplate.control.kinds import CONTROLLERS, kind_of
from swashplate.errors import ControllerError
from swashplate.simulation.controller import Controller


def save_controller(controller: Controller, path: str | Path) -> None:
    """Write a controller as a TOML file.

    Raises:
        ControllerError: where its kind has no file.
    """
    write_text(path, tomli_w.dumps(kind_of(controller).to_document(controller)))


def read_controller(path: str | Path) -> Controller:
    """A controller from its file.

    Raises:
        ControllerError: naming the file and the entry that is missing, unknown or no number.
    """
    document = documents.read_document(path, form="toml", error=ControllerError)
    if document.get("kind") != "controller":
        raise ControllerError(
            f"kind is {document.get('kind')!r:.60}, expected 'controller'.",
            where=path,
            hint="`swash control decouple MODEL --out FILE` writes one.",
        )
    name = document.get("type")
    if not isinstance(name, str) or name not in CONTROLLERS:
        raise ControllerError(f"is {name!r:.60}, expected {', '.join(CONTROLLERS)}.", where=path, channel="type")
    controller: Controller = CONTROLLERS[name].from_document(document, str(path))
    return controller
