"""Results as documents and files: written whole, read back whole, checked on the way."""

from __future__ import annotations

import json
import os
import tomllib
import typing
from collections.abc import Mapping, Sequence
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w

from swashplate import documents
from swashplate.arrays import Array
from swashplate.errors import CardError, DocumentError
from swashplate.identification.core.document_codec import decode, encode, part
from swashplate.identification.core.result import Result
from swashplate.models.card import card_from
from swashplate.models.catalogue import EQUATIONS, from_card
from swashplate.models.linear import state_space_file
from swashplate.models.linear.state_space import StateSpaceModel
from swashplate.models.linear.transfer_function import TransferFunction, TransferFunctions
from swashplate.models.residual import carrying
from swashplate.models.vehicle import Vehicle

KIND, SCHEMA = "result", 1
_HINT = "`swash identify --out DIR` (or fit-ss, fit-tf, fit-time) writes DIR/fit.json."
_SPECIAL = ("solution", "model", "start", "details", "seconds", "fitted", "validation")
_RARE = {"comparisons", "posterior", "truth"}
"""Entries that a document may lack."""
_TOLD = {"kind", "schema", "costs"}
"""Entries that are no field: what it is, and J of each response for readers who leave the comparisons out."""


def to_document(result: Result[object, object], *, comparisons: bool = True) -> dict[str, Any]:
    """A result as JSON types; its wall time is no part of it, so that equal results are equal documents.

    Args:
        result: any.
        comparisons: False leaves the time histories and responses out, which are most of it.
    """
    left_out = {*_SPECIAL, *(() if comparisons else ("comparisons",))}
    left_out |= {"posterior"} if result.posterior is None else set()
    left_out |= set() if result.truth else {"truth"}
    return {
        "kind": KIND,
        "schema": SCHEMA,
        **{f.name: encode(getattr(result, f.name)) for f in fields(result) if f.name not in left_out},
        "model": model_document(result.solution),
        "start": model_document(result.start),
        "details": encode(result.details),
        "costs": {c.name: encode(cost) for c, cost in zip(result.comparisons, result.costs, strict=False)},
    }


def from_document(
    document: Mapping[str, Any], *, where: str = "", equations: Vehicle | None = None
) -> Result[object, object]:
    """The result of a document.

    Args:
        document: of `to_document`.
        where: its file, for messages.
        equations: the vehicle whose equations it is of, for equations that are no part of the package and of no entry
            point.

    Raises:
        DocumentError: naming the entry that is missing, unknown or impossible.
        CardError: for a model that cannot be made again.
    """
    if document.get("kind") != KIND:
        raise DocumentError(f"is {document.get('kind')!r}, expected '{KIND}'.", where=where, channel="kind", hint=_HINT)
    if document.get("schema") != SCHEMA:
        raise DocumentError(
            f"is {document.get('schema')!r}, expected {SCHEMA}.", where=where, channel="schema", hint="Fit again."
        )
    hints = typing.get_type_hints(Result)
    table: dict[str, Any] = {}
    names = {f.name for f in fields(Result)} - {"seconds", "solution", "fitted", "validation"} | {"model"}
    for name in names - _RARE | (set(document) - _TOLD):
        if name not in names:
            raise DocumentError("is not known here.", where=where, channel=name[:60])
        if name not in document:
            raise DocumentError("is missing.", where=where, channel=name, hint=_HINT)
        if name not in _SPECIAL:
            table[name] = decode(hints[name], document[name], where=where, at=name)
    details = document["details"]
    result: Result[object, object] = Result(
        **table,
        solution=model_from(document["model"], where=where, at="model", equations=equations),
        start=model_from(document["start"], where=where, at="start", equations=equations),
        details=None if details is None else part(details, where=where, at="details"),
    )
    _check(result, where)
    return result


def save(result: Result[object, object], path: str | os.PathLike[str]) -> Path:
    """Write a result as a JSON file, which appears when it is complete."""
    from swashplate.atomic import write_text

    text = json.dumps(to_document(result), indent=2, allow_nan=False, ensure_ascii=False)
    write_text(Path(path), text + "\n")
    return Path(path)


def load(path: str | os.PathLike[str], *, equations: Vehicle | None = None) -> Result[object, object]:
    """A saved result, whole: estimates, matrices, comparisons with the data, and the model.

    Args:
        path: the file.
        equations: the vehicle whose equations it is of, for equations that are no part of the package and of no entry
            point of the group `swashplate.models`.

    Raises:
        DocumentError: for a file that is none, or is damaged, naming the entry.
        CardError: for a model that cannot be made again.
    """
    document = documents.read_document(os.fspath(path), form="json", hint=_HINT)
    return from_document(document, where=os.fspath(path), equations=equations)


# ---- models ----------------------------------------------------------------------------------------------------------
def model_document(model: Any) -> Any:
    """A vehicle, a state-space model or transfer functions as JSON types."""
    if isinstance(model, Vehicle):
        return {**encode(model.card.to_document()), "path": model.card.path}
    if isinstance(model, StateSpaceModel):
        return encode(tomllib.loads(state_space_file.to_toml(model)))
    return {"kind": "transfer-functions", "functions": [encode(one) for one in model]}


def model_from(document: object, *, where: str, at: str, equations: Vehicle | None) -> Any:
    """The model of a document.

    Raises:
        DocumentError: for another kind of document, naming the entry.
        CardError: for a model that cannot be made again.
    """
    if not isinstance(document, dict):
        raise DocumentError("is None, expected a kind of model.", where=where, channel=f"{at}.kind")
    kind = document.get("kind")
    if kind == "vehicle":
        path = document.get("path", "")
        card = card_from({k: v for k, v in document.items() if k != "path"}, path=where)
        card = replace(card, path=path if isinstance(path, str) else "")
        if equations is not None and equations.name == card.vehicle:
            return carrying(equations, card)
        if card.vehicle not in EQUATIONS:
            raise CardError(
                f"is a model of the equations '{card.vehicle}', which no package here has.",
                where=where,
                channel=at,
                hint=f"Give them: swashplate.load({where!r}, equations=...), or by an entry point (docs/extending.md).",
            )
        return from_card(card)
    if kind == "state-space":
        try:
            text = tomli_w.dumps(document)
        except (TypeError, ValueError):  # nothing is no value of a model's file
            raise DocumentError("has an entry that is nothing.", where=where, channel=at) from None
        return state_space_file.parse(text, path=where)
    if kind == "transfer-functions":
        functions = decode(tuple[TransferFunction, ...], document.get("functions"), where=where, at=f"{at}.functions")
        return TransferFunctions(functions)
    raise DocumentError(f"is {kind!r}, expected a kind of model.", where=where, channel=f"{at}.kind")


# ---- checks ----------------------------------------------------------------------------------------------------------
def _check(result: Result[object, object], where: str) -> None:
    known = [e.name for e in result.estimates]
    for key, names in (("estimates", known), ("names", result.names)):
        twice = sorted({n for n in names if names.count(n) > 1})
        if twice:
            raise DocumentError(f"names {', '.join(twice)} twice.", where=where, channel=key)
    for name in result.names:
        if name not in known:
            raise DocumentError(f"has '{name}', of which there is no estimate.", where=where, channel="names")
        if not np.isfinite(result[name].value):
            raise DocumentError("is no number.", where=where, channel=f"estimates, {name}")
    for key in ("covariance", "covariance_corrected", "correlation"):
        _check_covariance(getattr(result, key), result.names, key=key, where=where)


def _check_covariance(P: Array, names: Sequence[str], *, key: str, where: str) -> None:
    size = len(names)
    if P.shape != (size, size) and not (size == P.size == 0):
        raise DocumentError(f"is no matrix of {size} by {size} numbers.", where=where, channel=key)
    finite = P[np.isfinite(P)]
    if finite.size < P.size:  # a method without it, or parameters that leave no trace
        return
    scale = np.sqrt(np.abs(np.diag(P)))
    if not np.all(np.diag(P) >= 0.0) or np.any(np.abs(P - P.T) > 1e-6 * np.outer(scale, scale)):
        raise DocumentError("is no covariance: expected symmetry and a positive diagonal.", where=where, channel=key)
    if np.any(np.abs(P) > (1.0 + 1e-6) * np.outer(scale, scale)):
        raise DocumentError("is no covariance: a correlation lies beyond 1.", where=where, channel=key)
