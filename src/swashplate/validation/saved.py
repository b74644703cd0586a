"""Judgements of models as files: figures and words for readers, and under `saved` all of it, which `sp.load` reads."""

from __future__ import annotations

import os
import typing
from collections.abc import Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any

from swashplate.atomic import write_json
from swashplate.errors import DocumentError
from swashplate.identification.core.document_codec import decode, encode
from swashplate.identification.core.result_file import model_document, model_from
from swashplate.models.linear.state_space import StateSpaceModel
from swashplate.models.vehicle import Vehicle
from swashplate.registry import Registry
from swashplate.shown import Shown

Judged = Any
"""A `Validation`, `Verification`, `ModelComparison` or `Residuals`."""

KINDS: Registry[type] = Registry(
    "judgements",
    what="a judgement of a model",
    own={
        "validation": "swashplate.validation.validation:Validation",
        "verification": "swashplate.validation.verification:Verification",
        "comparison": "swashplate.validation.along_inputs:ModelComparison",
        "residuals": "swashplate.validation.residuals:Residuals",
    },
)
"""Classes by the `kind` of their files."""
SCHEMA = 1
_MODELS, _VERIFICATIONS = ("model", "vehicle", "published"), ("inside", "verification")
"""Fields that hold a model, and those that hold a `Verification`."""


class SavedWhole(Shown):
    """A judgement whose file is read back whole; its `to_document` gives `kind` and figures, for other programs."""

    def save(self, path: str | os.PathLike[str], /) -> Path:
        """Write it as a JSON file: `swashplate.load` reads it back."""
        return write_json(path, {**self.to_document(), "schema": SCHEMA, "saved": _plain_value(self)})


def from_document(document: Mapping[str, Any], *, where: str, equations: Vehicle | None = None) -> Judged:
    """The judgement of a document.

    Args:
        document: of a file that `SavedWhole.save` wrote.
        where: its name, for messages.
        equations: the vehicle whose equations its models have, for equations that are no part of the package.

    Raises:
        DocumentError: naming the entry that is missing, unknown or impossible.
        CardError: for a model that cannot be made again.
    """
    if document.get("schema") != SCHEMA or "saved" not in document:
        raise DocumentError(
            f"has the schema {document.get('schema')!r}, expected {SCHEMA}, or holds figures only.",
            where=where,
            channel="schema",
            hint="Make it again: this version writes all of it.",
        )
    return _restored(KINDS[document["kind"]], document["saved"], where=where, at="saved", equations=equations)


def _plain_value(value: Any) -> Any:
    if isinstance(value, Vehicle | StateSpaceModel):
        return model_document(value)
    if isinstance(value, Mapping) and any(isinstance(entry, KINDS["verification"]) for entry in value.values()):
        return {name: _plain_value(entry) for name, entry in value.items()}
    if any(isinstance(value, KINDS[kind]) for kind in KINDS):
        return {f.name: _plain_value(getattr(value, f.name)) for f in fields(value)}
    return encode(value)


def _restored(wanted: Any, table: Any, *, where: str, at: str, equations: Vehicle | None) -> Any:
    """An object of that class from its fields."""
    if not isinstance(table, dict):
        raise DocumentError("is no table.", where=where, channel=at)
    hints, fields_read = typing.get_type_hints(wanted), {}
    for name in dict.fromkeys([f.name for f in fields(wanted)] + list(table)):
        place = f"{at}.{name[:60]}"
        if name not in hints:
            raise DocumentError("is not known here.", where=where, channel=place)
        if name not in table:
            raise DocumentError("is missing.", where=where, channel=place)
        entry = table[name]
        if name in _MODELS:
            fields_read[name] = model_from(entry, where=where, at=place, equations=equations)
        elif name in _VERIFICATIONS:
            inner = KINDS["verification"]
            value = None if entry is None else _restored(inner, entry, where=where, at=place, equations=equations)
            fields_read[name] = value
        elif name == "found":
            if not isinstance(entry, dict):
                raise DocumentError("is no table.", where=where, channel=place)
            fields_read[name] = {
                who: _restored(KINDS["verification"], one, where=where, at=f"{place}.{who[:60]}", equations=equations)
                for who, one in entry.items()
            }
        else:
            fields_read[name] = decode(hints[name], entry, where=where, at=place)
    return wanted(**fields_read)
