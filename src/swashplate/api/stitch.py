"""Linear models at several speeds become one model from hover to forward flight."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from swashplate.errors import CardError, SwashError
from swashplate.flights.flight import Flight
from swashplate.identification.core.result import Result
from swashplate.models.catalogue import from_card
from swashplate.models.linear.linear_vehicle import structure_of
from swashplate.models.linear.state_space import StateSpaceModel
from swashplate.models.linear.state_space_file import structure
from swashplate.models.linear.stitching import stitch_points
from swashplate.models.linear.trimmed_matrices import TRIMMED
from swashplate.models.vehicle import Vehicle
from swashplate.simulation.linearize import LinearModel
from swashplate.simulation.trim import Trim

if TYPE_CHECKING:
    from swashplate.api.verbs.vehicle import StitchModels

Point: TypeAlias = LinearModel | StateSpaceModel | Vehicle | Result[object, object] | str | Path
"""A linear model at one speed, or its file."""
PointTrim: TypeAlias = Trim | Flight | Mapping[str, float]
"""Where a point stands: a trim, a flight whose means it is, or values by name."""


def stitch_asked(asked: StitchModels) -> Vehicle:
    """The model that was asked for (Tobias and Tischler 2016)."""
    listed = asked.points if isinstance(asked.points, list | tuple) else (asked.points,)
    points = [one for point in listed for one in (_files(Path(point)) if isinstance(point, str | Path) else [point])]
    if asked.trim is not None and len(asked.trim) != len(points):
        raise SwashError(f"{len(asked.trim)} given for {len(points)} points, expected one each.", channel="--trim")
    trims = [asked.read(one)[0] if isinstance(one, str | Path) else one for one in asked.trim or ()]
    names = [_name(point, k) for k, point in enumerate(points)]
    models = [_model(point) for point in points]
    told = trims or [None] * len(points)
    known = [_with_trim(m, t, n) for m, t, n in zip(models, told, names, strict=True)]
    return from_card(stitch_points(known, names=names, gradients=asked.gradients, title=asked.title))  # pyrefly: ignore[bad-argument-type]


def _files(place: Path) -> list[Path]:
    """A point's file, or those of a folder."""
    if not place.is_dir():
        return [place]
    files = sorted(place.glob("*.toml"))
    if not files:
        raise SwashError("has no .toml file in it.", where=place, channel="POINT")
    return files


def _name(point: Point, k: int) -> str:
    if isinstance(point, str | Path):
        return Path(point).name
    return f"point {k + 1}" if isinstance(point, LinearModel) else f"point {k + 1}, {point.name}"


def _model(point: Point) -> StateSpaceModel:
    if isinstance(point, str | Path):
        return structure(point)
    if isinstance(point, LinearModel):
        return point.to_structure()
    return structure_of(point.model if isinstance(point, Result) else point)


def _with_trim(model: StateSpaceModel, told: PointTrim | None, name: str) -> StateSpaceModel:
    """The model with another [trim]."""
    if told is None:
        return model
    kept = dict.fromkeys((*TRIMMED, *model.states, *model.inputs))
    if isinstance(told, Trim):
        values = told.states() | told.commands() | {"air_density": float(told.environment.air_density)}
    elif isinstance(told, Flight):
        if lost := [channel for channel in (*TRIMMED, *model.inputs) if channel not in told]:
            raise SwashError(
                f"has no {', '.join(lost)}, whose means shall be the trim of {name}.",
                where=told.provenance.source,
                channel="trims",
                hint="Map its columns, or write [trim] into the point's file.",
            )
        still = dict.fromkeys(("p", "q", "r"), 0.0)
        values = {channel: float(np.nanmean(told.values(channel))) for channel in kept if channel in told} | still
    else:
        values = {key: float(value) for key, value in told.items()}
        if strange := [key for key in values if key not in kept and key != "air_density"]:
            raise CardError(f"is no state and no input of {name}.", channel=strange[0], where="trims")
    trim = {key: repr(value) for key, value in values.items() if key in kept or key == "air_density"}
    return replace(model, document={**model.document, "trim": {**model.document.get("trim", {}), **trim}})
