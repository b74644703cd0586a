"""The verb `stitch`: linear models at several speeds become one model from hover to forward flight."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from swashplate.errors import CardError, SwashError
from swashplate.flights.flight import Flight
from swashplate.identification.core.result import Result
from swashplate.models.catalogue import from_card
from swashplate.models.linear.linear_vehicle import structure_of
from swashplate.models.linear.state_space import StateSpaceModel
from swashplate.models.linear.state_space_file import structure
from swashplate.models.linear.stitching import Gradients, stitch_points
from swashplate.models.linear.trimmed_matrices import TRIMMED
from swashplate.models.vehicle import Vehicle
from swashplate.simulation.linearize import LinearModel
from swashplate.simulation.trim import Trim

Point: TypeAlias = LinearModel | StateSpaceModel | Vehicle | Result[Any, Any] | str | Path
"""A linear model at one speed, or its file."""
PointTrim: TypeAlias = Trim | Flight | Mapping[str, float]
"""Where a point stands: a trim, a flight whose means it is, or values by name."""


def stitch(
    points: Sequence[Point],
    *,
    trims: Sequence[PointTrim | None] | None = None,
    gradients: Gradients | None = None,
    title: str = "",
) -> Vehicle:
    """One model from linear models about steady flights at several speeds (Tobias and Tischler 2016).

    Trims and derivatives are interpolated over the air speed ahead, gravity and kinematics are nonlinear. It trims,
    linearises, flies, exports and is saved as any vehicle; `swashplate.models.linear.stitched` has the equations.
    Between the points it is near what they were made of; beyond them trims and derivatives are held.

    Args:
        points: with equal states and inputs, each about a straight level flight: models of `linearize`, identified
            models, fits, or files of them.
        trims: of the points, in their order, before what a point says itself; None, or None for one, where its [trim]
            says all.
        gradients: how trims change with speed at the points: "derivatives", as the points' own derivatives say, which
            keeps them; "trims", by differences of the trims, which then stand for the derivatives by speed. None takes
            the first for linearised models and the second where a point was identified.
        title: of the model; made of the speeds where "".

    Raises:
        CardError: fewer than two points, two at one speed, other states, inputs or units, no trim, no level flight,
            kinematics or gravity that do not belong to the trim.
        SwashError: trims that are not as many as the points, or a flight without what its means shall tell.
    """
    if trims is not None and len(trims) != len(points):
        raise SwashError(f"{len(trims)} given for {len(points)} points, expected one each.", channel="trims")
    names = [_name(point, k) for k, point in enumerate(points)]
    models = [_model(point) for point in points]
    told = trims or [None] * len(points)
    known = [_with_trim(m, t, n) for m, t, n in zip(models, told, names, strict=True)]
    return from_card(stitch_points(known, names=names, gradients=gradients, title=title))


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
