"""Smaller linear models: states left out, states that follow without delay, the paper's layout, what may be omitted."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from swashplate.arrays import Array, Complex
from swashplate.errors import SwashError
from swashplate.models.conventional.derivative_table import ROWS
from swashplate.models.vehicle import Vehicle
from swashplate.shown import Saved
from swashplate.simulation.derivatives import derivative_table
from swashplate.simulation.linearize import LinearModel, linearize
from swashplate.simulation.trim import Trim
from swashplate.text_table import text_table

PAPER_STATES = ("u", "w", "q", "theta", "v", "p", "phi", "r")
PAPER_INPUTS = ("theta0", "B1", "A1", "theta0T")
"""Order of Bhandari et al. (2005), eqs 13 and 14."""
LONGITUDINAL = (("u", "w", "q", "theta"), ("theta0", "B1"))
LATERAL = (("v", "p", "phi", "r"), ("A1", "theta0T"))
"""States and inputs of the models with three degrees of freedom."""
HYBRID = ("u", "v", "w", "p", "q", "r", "phi", "theta", "a1", "b1")
"""Rigid body with flapping, ten states (Tischler and Remple 2012, sec. 15.2)."""
METTLER = ("u", "v", "p", "q", "phi", "theta", "a1", "b1", "w", "r", "r_gyro", "c", "d")
"""With stabilizer bar and yaw loop, thirteen states (Mettler 2003, eq. 4.30)."""

_PRINTED_A = (
    "u w q theta v p r",
    "w theta phi",
    "u w q v p r",
    "q",
    "u q theta v p phi r",
    "u q v p r",
    "q p r",
    "w v p r",
)
_PRINTED_B = (
    "theta0 B1 A1",
    "theta0",
    "theta0 B1 A1 theta0T",
    "",
    *("theta0 B1 A1 theta0T",) * 2,
    "",
    "theta0 theta0T",
)


def residualise(model: LinearModel, keep: Sequence[str]) -> LinearModel:
    """The model with only the states in `keep`, in that order; all others follow without delay.

    A11 - A12 A22^-1 A21, and B likewise (Kokotovic, Khalil and O'Reilly 1986): right at low frequency. Position and
    heading, which nothing else depends on in a trim's linear model, are simply left out.

    Raises:
        SwashError: for a state that the model does not have.
    """
    places = [_place(model, name) for name in keep]
    free = [model.states.index(n) for n in ("x", "y", "z", "psi") if n in model.states and n not in keep]
    fast = [i for i in range(len(model.states)) if i not in places and i not in free]
    A11, A12 = model.A[np.ix_(places, places)], model.A[np.ix_(places, fast)]
    follow = -np.linalg.solve(
        model.A[np.ix_(fast, fast)], np.hstack([model.A[np.ix_(fast, places)], model.B[fast], model.G[fast]])
    )
    n, m = len(places), model.B.shape[1]
    return _made(
        model,
        tuple(keep),
        A11 + A12 @ follow[:, :n],
        model.B[places] + A12 @ follow[:, n : n + m],
        model.G[places] + A12 @ follow[:, n + m :],
        model.inputs,
    )


def part(model: LinearModel, states: Sequence[str], inputs: Sequence[str]) -> LinearModel:
    """The model with all other states and inputs held at zero: coupling to them is left out."""
    rows = [_place(model, name) for name in states]
    columns = [model.inputs.index(name) for name in inputs]
    return _made(
        model,
        tuple(states),
        model.A[np.ix_(rows, rows)],
        model.B[np.ix_(rows, columns)],
        model.G[rows],
        tuple(inputs),
    )


def paper_model(model: LinearModel, *, as_printed: bool = False) -> LinearModel:
    """Bhandari et al. (2005), eqs 13 and 14: eight states, flapping without delay, in the paper's order.

    Args:
        model: a single-rotor helicopter's, flapping and whatever else among its states.
        as_printed: leave out what the paper leaves out (Z_u, Z_q, L_w, N_u, N_q and their like, the kinematic terms of
            forward flight, - sin(phi) in the row of theta); it is meant for hover.
    """
    eight = part(residualise(model, PAPER_STATES), PAPER_STATES, PAPER_INPUTS)
    if not as_printed:
        return eight
    A, B = eight.A - kinematic_terms(eight), eight.B.copy()
    for i, (in_A, in_B) in enumerate(zip(_PRINTED_A, _PRINTED_B, strict=True)):
        A[i, [j for j, name in enumerate(PAPER_STATES) if name not in in_A.split()]] = 0.0
        B[i, [j for j, name in enumerate(PAPER_INPUTS) if name not in in_B.split()]] = 0.0
    return replace(eight, A=A, B=B)


def kinematic_terms(model: LinearModel) -> Array:
    """What forward flight alone puts into A (omega x v), shape (n, n)."""
    trim, index = model.trim.states(), {name: i for i, name in enumerate(model.states)}
    A = np.zeros_like(model.A)
    for row, column, sign, of in (
        ("u", "q", -1, "w"), ("u", "r", 1, "v"), ("w", "q", 1, "u"), ("w", "p", -1, "v"), ("v", "p", 1, "w"),
        ("v", "r", -1, "u"),
    ):  # fmt: skip
        A[index[row], index[column]] = sign * trim[of]
    return A


FORMS = ("full", "paper", "printed", "longitudinal", "lateral", "flapping", "bar-and-gyro")
"""What `in_form` makes."""


def in_form(model: LinearModel, form: str) -> LinearModel:
    """A single-rotor helicopter's linear model in one of `FORMS`.

    "full": as it is; "paper" and "printed": `paper_model`; "longitudinal" and "lateral": three degrees of freedom of
    it, without the coupling; "flapping": ten states; "bar-and-gyro": thirteen.

    Raises:
        SwashError: where the form is not known, or the model is not of a single-rotor helicopter.
    """
    if form not in FORMS:
        raise SwashError(f"is '{form}', expected one of {', '.join(FORMS)}.", channel="form")
    if form == "full":
        return model
    if not set(PAPER_INPUTS) <= set(model.inputs):
        raise SwashError("is for single-rotor helicopters.", channel="form")
    if form in ("flapping", "bar-and-gyro"):
        return residualise(model, HYBRID if form == "flapping" else METTLER)
    if form in ("paper", "printed"):
        return paper_model(model, as_printed=form == "printed")
    return part(paper_model(model), *(LONGITUDINAL if form == "longitudinal" else LATERAL))


@dataclass(frozen=True)
class Omission:
    """What leaving one derivative out does.

    Attributes:
        derivative: e.g. "Xr".
        value: what it was, SI.
        modes: largest relative change of an eigenvalue.
        response: largest relative change of the frequency responses q/B1, p/A1, r/theta0T and w/theta0.
    """

    derivative: str
    value: float
    modes: float
    response: float


_WATCHED = (("q", "B1"), ("p", "A1"), ("r", "theta0T"), ("w", "theta0"))
_BAND = np.geomspace(0.5, 20.0, 60)
"""rad/s."""


def omissions(model: LinearModel) -> tuple[Omission, ...]:
    """Every derivative of a `paper_model`, left out one at a time; those that matter least come first.

    The study behind the paper's remark that X_r may be excluded. Kinematic and gravity terms stay.
    """
    rows = dict(zip(("u", "v", "w", "p", "q", "r"), ROWS, strict=True))
    kinematic, index = kinematic_terms(model), {name: i for i, name in enumerate(model.states)}
    nominal, response = np.linalg.eigvals(model.A).astype(complex), _responses(model.A, model.B, model)
    left_out = []
    for name, letter in rows.items():
        for column in rows:
            value = float(model.A[index[name], index[column]] - kinematic[index[name], index[column]])
            A = model.A.copy()
            A[index[name], index[column]] -= value
            left_out.append(_omission(f"{letter}{column}", value, A, model.B, model, nominal, response))
        for j, control in enumerate(model.inputs):
            B = model.B.copy()
            value = float(B[index[name], j])
            B[index[name], j] = 0.0
            left_out.append(_omission(f"{letter}{control}", value, model.A, B, model, nominal, response))
    return tuple(sorted(left_out, key=lambda entry: max(entry.modes, entry.response)))


@dataclass(frozen=True, repr=False)
class OmissionStudy(Saved):
    """What leaving out each derivative changes, at some speeds [m/s]; those that matter least come first."""

    speeds: tuple[float, ...]
    omissions: tuple[tuple[Omission, ...], ...]

    def rows(self, place: int) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
        """Heading and cells of the table at one of the speeds."""
        cells: list[tuple[str, ...]] = [
            (each.derivative, f"{each.value:.3g}", f"{each.modes:.1e}", f"{each.response:.1e}")
            for each in self.omissions[place]
        ]
        return ("left out", "value", "modes", "responses"), cells

    def to_document(self) -> list[dict[str, Any]]:
        """Numbers as JSON types."""
        return [
            {"speed": speed, "left_out": [vars(each) for each in study]}
            for speed, study in zip(self.speeds, self.omissions, strict=True)
        ]

    def __repr__(self) -> str:
        return "\n\n".join(f"At {v:g} m/s\n{text_table(*self.rows(k))}" for k, v in enumerate(self.speeds))


def omit_derivatives(vehicle: Vehicle, trims: Trim | Sequence[Trim]) -> OmissionStudy:
    """What leaving out each derivative of the paper's model changes of modes and responses.

    Args:
        vehicle: a single-rotor helicopter.
        trims: one or several.

    Raises:
        SwashError: for a vehicle without derivatives by contributor.
    """
    at = (trims,) if isinstance(trims, Trim) else tuple(trims)
    derivative_table(vehicle, at[0])  # refuses what has none
    studies = tuple(omissions(paper_model(linearize(vehicle, each))) for each in at)
    return OmissionStudy(tuple(each.speed for each in at), studies)


def _omission(
    name: str,
    value: float,
    A: Array,
    B: Array,
    model: LinearModel,
    nominal: Complex,
    response: Complex,
) -> Omission:
    from scipy.optimize import linear_sum_assignment

    values = np.linalg.eigvals(A)
    _, order = linear_sum_assignment(np.abs(nominal[:, None] - values[None, :]))
    change = float(np.max(np.abs(values[order] - nominal) / np.abs(nominal)))
    changed = np.abs(_responses(A, B, model) - response)
    relative = float(np.max(np.linalg.norm(changed, axis=0) / np.linalg.norm(response, axis=0)))
    return Omission(name, value, change, relative)


def _responses(A: Array, B: Array, model: LinearModel) -> Complex:
    """Frequency responses of `_WATCHED`, shape (frequencies, pairs)."""
    rows = []
    for frequency in _BAND:
        G = np.linalg.solve(1j * frequency * np.eye(len(A)) - A, B)
        rows.append([G[model.states.index(y), model.inputs.index(u)] for y, u in _WATCHED])
    return np.array(rows)


def _place(model: LinearModel, name: str) -> int:
    if name not in model.states:
        raise SwashError(
            f"is not a state of this model; it has {', '.join(model.states)}.",
            channel=name,
            hint="Turn the vehicle's option on that adds it (bar, gyro, inflow).",
        )
    return model.states.index(name)


def _made(
    model: LinearModel, states: tuple[str, ...], A: Array, B: Array, G: Array, inputs: tuple[str, ...]
) -> LinearModel:
    n, m = B.shape
    return replace(model, A=A, B=B, C=np.eye(n), D=np.zeros((n, m)), G=G, states=states, inputs=inputs)
