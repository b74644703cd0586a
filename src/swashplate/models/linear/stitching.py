"""From linear models with trims at several speeds to the card of one stitched model."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Any, Literal

import numpy as np

from swashplate.errors import CardError
from swashplate.models.card import Card, Parameter
from swashplate.models.linear.card_vehicle import NEEDED, entry_name, entry_unit
from swashplate.models.linear.linear_vehicle import USUAL_RANGE
from swashplate.models.linear.state_space import StateSpaceModel
from swashplate.models.linear.state_space_file import trim_of
from swashplate.models.linear.stitched import NAME, STILL, SpeedPoint, gradient_unit
from swashplate.models.linear.trimmed_matrices import (
    TRIMMED,
    TrimmedMatrices,
    differences,
    own_gradients,
    without_kinematics,
)
from swashplate.models.surroundings import SECTION
from swashplate.physics.environment import SEA_LEVEL_DENSITY
from swashplate.physics.rigid_body import BODY_UNITS, RigidBody

Gradients = Literal["derivatives", "trims"]
_PLACE = ("x", "y", "z", "psi")
_ASIDE = 0.1
"""Share of the speed (m/s below 1 m/s) that a point may climb or slip and still be level flight ahead."""
_NOTHING = 1e-6
_APART = 1e-3
"""m/s: points at closer speeds are at the same."""


def stitch_points(
    points: Sequence[StateSpaceModel], *, names: Sequence[str], gradients: Gradients | None = None, title: str = ""
) -> Card:
    """The card of the model that is stitched from linear models, each with its [trim].

    Args:
        points: with the same states and inputs, each about a straight and level flight, at different speeds.
        names: what messages call them.
        gradients: of the trims by speed: "derivatives", each point's own, for which A x' + B u' is zero; "trims",
            three-point differences. None: the first where no point's numbers carry the accuracy of a fit.
        title: of the model; one is made of the speeds where it is "".

    Raises:
        CardError: too few points, other states or inputs, no trim or no level flight, equal speeds, a point that has
            other kinematics or gravity than its trim.
    """
    if len(points) < 2:
        raise CardError(f"{len(points)} given, expected two or more, at different speeds.", channel="points")
    for model, name in zip(points[1:], names[1:], strict=True):
        _same(points[0], model, names[0], name)
    trims = [trim_of(model) for model in points]
    inner = tuple(state for state in points[0].states if state not in RigidBody._fields)
    notes = [f"{state} counts from its trim." for state in _untold(trims, inner, names)]
    every = sorted(
        (
            (_trimmed(m, n, trim, inner, points[0].inputs), m, trim)
            for m, n, trim in zip(points, names, trims, strict=True)
        ),
        key=lambda one: one[0].speed,
    )
    trimmed = [one for one, _, _ in every]
    for slow, fast in pairwise(trimmed):
        if fast.speed - slow.speed < _APART:
            raise CardError(f"is {fast.speed:.4g} m/s, as that of {slow.name}.", where=fast.name, channel="trim.u")
    fitted = any(np.isfinite(p.cramer_rao) for model in points for p in model.parameters.values())
    how = gradients or ("trims" if fitted else "derivatives")
    free = [i for i in points[0].inputs if np.ptp([one.trim[i] for one in trimmed]) > 0.0]
    slopes = differences(trimmed) if how == "trims" else [own_gradients(one, free) for one in trimmed]
    stitched = [
        SpeedPoint(m.name, inner, m.inputs, m.trim, without_kinematics(m, fitted=fitted), m.B[m.rows], slope)
        for m, slope in zip(trimmed, slopes, strict=True)
    ]
    notes.append(
        "Gradients of the trims are what the points' own derivatives say, so that these are kept."
        if how == "derivatives"
        else "Gradients of the trims are differences of the trims; they stand for the points' derivatives by speed."
    )
    densities = {trim["air_density"] for _, _, trim in every if "air_density" in trim}
    if len(densities) > 1:
        raise CardError(
            f"are {', '.join(f'{d:g}' for d in sorted(densities))} kg/m^3, expected one.", channel="trim.air_density"
        )
    if not densities:
        notes.append("No point says the air's density: that of a calm day near the ground is assumed.")
    options: dict[str, Any] = {"points": len(trimmed), "inner": list(inner)}
    options |= {"inner_units": [points[0].units.get(name, "1") or "1" for name in inner]}
    options |= {"inputs": list(points[0].inputs)}
    options |= {"input_units": [points[0].units.get(name, "1") or "1" for name in points[0].inputs]}
    options |= _limits([model for _, model, _ in every], trimmed, notes)
    options |= {"air_density": densities.pop() if densities else SEA_LEVEL_DENSITY}
    delays = _delays([model for _, model, _ in every], trimmed[0].inputs, notes)
    speeds = ", ".join(f"{one.speed:.3g}" for one in trimmed)
    return Card(
        vehicle=NAME,
        title=title or f"Stitched at {speeds} m/s",
        trust=f"Between {trimmed[0].speed:.3g} and {trimmed[-1].speed:.3g} m/s ahead, near the trims; beyond, trims "
        f"and derivatives are held. {' '.join(notes)}",
        options=options,
        parameters=_parameters(stitched, options, "identified" if fitted else "derived"),
        observer={SECTION: delays} if delays else {},
    )


def _same(first: StateSpaceModel, model: StateSpaceModel, name: str, other: str) -> None:
    for what in ("states", "inputs"):
        ours, theirs = getattr(first, what), getattr(model, what)
        if set(ours) != set(theirs):
            raise CardError(
                f"are {', '.join(theirs)}; those of {name} are {', '.join(ours)}.",
                where=other,
                channel=what,
                hint="All points need the same.",
            )
        for one in ours:
            unit, wanted = model.units.get(one, "1"), first.units.get(one, "1")
            if unit != wanted:
                raise CardError(f"is in {unit}; that of {name} is in {wanted}.", where=other, channel=one)


def _untold(trims: Sequence[dict[str, float]], inner: Sequence[str], names: Sequence[str]) -> list[str]:
    """Inner states of which no point says a trim: they count from it, so that it is set to zero."""
    silent = []
    for state in inner:
        lacking = [name for trim, name in zip(trims, names, strict=True) if state not in trim]
        if lacking and len(lacking) < len(names):
            raise CardError(f"says nothing of {state}, and other points do.", where=lacking[0], channel="trim")
        if lacking:
            silent.append(state)
            for trim in trims:
                trim[state] = 0.0
    return silent


def _trimmed(
    model: StateSpaceModel, name: str, trim: dict[str, float], inner: tuple[str, ...], inputs: tuple[str, ...]
) -> TrimmedMatrices:
    """A point's matrices in the order that all share, with its trim."""
    if lost := [state for state in NEEDED if state not in model.states]:
        raise CardError(
            f"has no equation for {', '.join(lost)}: that is not enough to fly.", where=name, channel="states"
        )
    for state, unit in zip(RigidBody._fields, BODY_UNITS, strict=True):
        if model.units.get(state, unit) != unit:
            raise CardError(f"is in {model.units[state]}, expected {unit}.", where=name, channel=state)
    A, B, _, _ = model.explicit()
    order = [*NEEDED, *inner]
    places = [model.states.index(state) for state in order]
    for state in (s for s in _PLACE if s in model.states):
        driven = [row for row, k in zip(order, places, strict=True) if abs(A[k, model.states.index(state)]) > _NOTHING]
        if driven:
            raise CardError(
                f"moves {', '.join(driven)}: a stitched model knows no place.",
                where=name,
                channel=state,
                hint="Linearise well above the ground.",
            )
    if lost := [entry for entry in (*TRIMMED, *inputs) if entry not in trim]:
        raise CardError(
            f"says nothing of {', '.join(lost)}.",
            where=name,
            channel="trim",
            hint="Add them to [trim], as `vehicle linearize --out` does, or give the flight with such means: --trim.",
        )
    if turning := [rate for rate in STILL if abs(trim.get(rate, 0.0)) > _NOTHING]:
        raise CardError("is not zero, expected a straight flight.", where=name, channel=f"trim.{turning[0]}")
    wanted = (*TRIMMED, *inner, *inputs)
    columns = [model.inputs.index(entry) for entry in inputs]
    matrices = TrimmedMatrices(
        name, inner, inputs, A[np.ix_(places, places)], B[np.ix_(places, columns)], {k: trim[k] for k in wanted}
    )
    over = matrices.course()
    if max(abs(over.y), abs(over.z)) > _ASIDE * max(1.0, abs(over.x)):
        raise CardError(
            f"flies {over.x:.2f} m/s ahead, {over.y:.2f} m/s right, {-over.z:.2f} m/s up; expected level flight ahead.",
            where=name,
            channel="trim",
            hint="u, v and w are along the body's axes, angles in rad.",
        )
    return matrices


def _limits(models: Sequence[StateSpaceModel], trimmed: Sequence[TrimmedMatrices], notes: list[str]) -> dict[str, Any]:
    """Ranges of the inputs: the widest that a file says about its trim; an assumed one about all trims otherwise."""
    ends: dict[str, Any] = {"low": [], "high": []}
    assumed = []
    for name in trimmed[0].inputs:
        ranges = [
            (model.document.get("limits", {}).get(name), one.trim[name])
            for model, one in zip(models, trimmed, strict=True)
        ]
        known = [(at + low, at + high) for (low, high), at in ((r, at) for r, at in ranges if r is not None)]
        if not known:
            usual = USUAL_RANGE.get(models[0].units.get(name, "1") or "1", 1.0)
            known = [(at - usual, at + usual) for _, at in ranges]
            assumed.append(f"{name} {usual:.3g}")
        ends["low"].append(float(min(low for low, _ in known)))
        ends["high"].append(float(max(high for _, high in known)))
    if assumed:
        notes.append(f"Ranges of inputs are assumed about the trims: {', '.join(assumed)} either way.")
    return ends


def _delays(models: Sequence[StateSpaceModel], inputs: Sequence[str], notes: list[str]) -> dict[str, float]:
    """One delay for every input [s], the mean of the points'; empty where no point has any."""
    delays = {}
    for name in inputs:
        lags = np.array([model.delay(output, name) for model in models for output in model.outputs] or [0.0])
        delays[name] = max(0.0, float(lags.mean()))
        if np.ptp(lags) > 1e-9:
            notes.append(f"Delay of {name}: mean of {1e3 * lags.min():.3g} to {1e3 * lags.max():.3g} ms.")
    return delays if any(delays.values()) else {}


def _parameters(points: Sequence[SpeedPoint], options: Any, status: str) -> dict[str, Parameter]:
    units = dict(zip(RigidBody._fields, BODY_UNITS, strict=True))
    units |= dict(zip(options["inner"], options["inner_units"], strict=True))
    units |= dict(zip(options["inputs"], options["input_units"], strict=True))
    columns = (*points[0].columns, *points[0].inputs)
    numbers = [np.hstack([point.X, point.B]) for point in points]
    there = np.any([matrix != 0.0 for matrix in numbers], axis=0)
    parameters = {}
    for k, (point, matrix) in enumerate(zip(points, numbers, strict=True)):
        source = f"derived: {point.name}"
        for i, j in zip(*np.nonzero(there), strict=True):
            row, column = point.rows[i], columns[j]
            unit = entry_unit(units[row], units[column])
            parameters[f"{entry_name(row, column)}_{k}"] = Parameter(float(matrix[i, j]), unit, source, status)
        for name, value in point.trim.items():
            parameters[f"trim_{name}_{k}"] = Parameter(float(value), units[name], source, status)
        for name, value in point.gradients.items():
            parameters[f"gradient_{name}_{k}"] = Parameter(value, gradient_unit(units[name]), source, "derived")
    return parameters
