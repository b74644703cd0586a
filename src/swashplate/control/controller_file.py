"""Controllers as files: `kind = "controller"`, every number by name, readable and editable."""

from __future__ import annotations

import math
import tomllib
from pathlib import Path
from typing import Any

import tomli_w

from swashplate.atomic import write_text
from swashplate.control.autopilot import MODES, Autopilot, CyclicGains, Gains
from swashplate.control.decoupling import Decoupler
from swashplate.control.height_yaw import CoaxialRotors, HeightYawGains
from swashplate.control.lqg import Lqg
from swashplate.control.lqg_file import TYPE as LQG
from swashplate.control.lqg_file import lqg_from, save_lqg
from swashplate.control.observed_autopilot import TYPE as OBSERVED
from swashplate.control.observed_autopilot import ObservedAutopilot, save_observed
from swashplate.errors import ControllerError

SCHEMA = 1
TYPE = "autopilot"
_GROUPS: dict[str, Any] = {
    "motors": HeightYawGains,
    "rotors": CoaxialRotors,
    "cyclic": CyclicGains,
    "law": Decoupler,
}


def save_controller(controller: Autopilot | Lqg | ObservedAutopilot, path: str | Path) -> None:
    """Write a controller as a TOML file."""
    if isinstance(controller, Lqg):
        save_lqg(controller, path)
    elif isinstance(controller, ObservedAutopilot):
        save_observed(controller, tomli_w.dumps(_autopilot_document(controller.autopilot)), path)
    else:
        write_text(path, tomli_w.dumps(_autopilot_document(controller)))


def _autopilot_document(controller: Autopilot) -> dict[str, Any]:
    return {
        "kind": "controller",
        "schema": SCHEMA,
        "type": TYPE,
        "vehicle": controller.vehicle,
        "model": controller.model,
        "mode": controller.mode,
        "rate": controller.rate,
        **{name: getattr(controller.numbers, name)._asdict() for name in _GROUPS},
    }


def read_controller(path: str | Path) -> Autopilot | Lqg | ObservedAutopilot:
    """A controller from its file.

    Raises:
        ControllerError: naming the file and the entry that is missing, unknown or no number.
    """
    try:
        document = tomllib.loads(Path(path).read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise ControllerError("there is no such file.", where=path, hint="Check the path.") from None
    except (OSError, UnicodeDecodeError) as error:
        raise ControllerError(f"cannot be read: {error}.", where=path) from None
    except tomllib.TOMLDecodeError as error:
        raise ControllerError(f"is not TOML: {error}.", where=path) from None
    if document.get("kind") != "controller":
        raise ControllerError(
            f"kind is {document.get('kind')!r}, expected 'controller'.",
            where=path,
            hint="`swash decouple MODEL --out FILE` writes one.",
        )
    if document.get("type") == LQG:
        return lqg_from(document, path)
    if document.get("type") == OBSERVED:
        observer = document.pop("observer", {})
        law = _autopilot_from({**document, "type": TYPE}, path)
        return ObservedAutopilot(law, lqg_from(observer, path))
    return _autopilot_from(document, path)


def _autopilot_from(document: dict[str, Any], path: str | Path) -> Autopilot:
    if document.get("type") != TYPE or document.get("schema") != SCHEMA:
        found = f"type {document.get('type')!r}, schema {document.get('schema')!r}"
        raise ControllerError(f"{found}: expected type '{TYPE}', schema {SCHEMA}.", where=path)
    if document.get("mode") not in MODES:
        raise ControllerError(f"is {document.get('mode')!r}, expected {', '.join(MODES)}.", where=path, channel="mode")
    rate = _number(document, "rate", path)
    if rate <= 0.0:
        raise ControllerError(f"is {rate:g} Hz, expected a positive rate.", where=path, channel="rate")
    groups = {name: _group(document.get(name), name, kind, path) for name, kind in _GROUPS.items()}
    return Autopilot(
        str(document.get("vehicle", "")), str(document.get("model", "")), document["mode"], Gains(1.0 / rate, **groups)
    )


def _group(entries: Any, name: str, kind: Any, path: str | Path) -> Any:
    if not isinstance(entries, dict):
        raise ControllerError("is missing.", where=path, channel=f"[{name}]")
    missing, unknown = sorted(set(kind._fields) - entries.keys()), sorted(entries.keys() - set(kind._fields))
    if missing or unknown:
        raise ControllerError(f"lacks {missing} and has unknown {unknown}.", where=path, channel=f"[{name}]")
    return kind(**{field: _number(entries, field, path) for field in kind._fields})


def _number(entries: dict[str, Any], name: str, path: str | Path) -> float:
    value = entries.get(name)
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise ControllerError(f"is {value!r}, expected a number.", where=path, channel=name)
    return float(value)
