"""What the points of a stitched model say: their numbers, and whether speed derivatives and trims agree."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from swashplate.arrays import Array
from swashplate.models.card import Card
from swashplate.models.linear.card_vehicle import NEEDED, entry_name
from swashplate.models.vehicle import Vehicle
from swashplate.physics.environment import LABORATORY_GRAVITY
from swashplate.text_table import text_table

RATES = ("u", "v", "w", "p", "q", "r")
"""Of the rigid body, the states that have rows of numbers; all others follow from kinematics."""
STILL = ("p", "q", "r")
"""States that are zero in every trim."""
_LETTERS = dict(zip(RATES, "XYZLMN", strict=True))


@dataclass(frozen=True)
class SpeedPoint:
    """A linear model about a steady level flight.

    Attributes:
        name: what messages call it.
        inner, inputs: names of the states beside the rigid body's, and of the inputs.
        trim: values of the states and inputs; without the still ones.
        X, B: derivatives of RATES and inner states' rates by (NEEDED, inner) and inputs; gravity and Coriolis terms
            are not in X.
        gradients: of the trims by the speed ahead.
    """

    name: str
    inner: tuple[str, ...]
    inputs: tuple[str, ...]
    trim: Mapping[str, float]
    X: Array
    B: Array
    gradients: Mapping[str, float]

    @property
    def rows(self) -> tuple[str, ...]:
        return (*RATES, *self.inner)

    @property
    def columns(self) -> tuple[str, ...]:
        return (*NEEDED, *self.inner)

    @property
    def speed(self) -> float:
        """Ahead [m/s]."""
        return self.trim["u"]

    def implied(self) -> Array:
        """Derivatives of the rows by speed that the trims' gradients stand for: d(-g)/du - X x_t' - B u_t'."""
        moved = np.array([0.0 if name == "u" else self.gradients.get(name, 0.0) for name in self.columns])
        driven = np.array([self.gradients[name] for name in self.inputs])
        weight = np.zeros(len(self.rows))
        turned = gravity_slope(self.trim) @ [self.gradients["phi"], self.gradients["theta"]]
        weight[:3] = -turned
        return np.asarray(weight - self.X @ moved - self.B @ driven)

    def given(self) -> Array:
        """The point's own derivatives of the rows by speed."""
        return np.asarray(self.X[:, self.columns.index("u")])


def gravity_slope(trim: Mapping[str, float], g: float = LABORATORY_GRAVITY) -> Array:
    """Derivative of gravity in body axes [m/s^2] by roll and pitch, shape (3, 2)."""
    sf, cf, st, ct = (f(trim[name]) for name in ("phi", "theta") for f in (np.sin, np.cos))
    return g * np.array([[0.0, -ct], [cf * ct, -sf * st], [-sf * ct, -cf * st]])


def points_of(card: Card) -> tuple[SpeedPoint, ...]:
    """The points of a stitched model's card."""
    inner, inputs = tuple(card.options["inner"]), tuple(card.options["inputs"])
    values = card.values()

    def table(columns: tuple[str, ...], k: int) -> Array:
        rows = [[values.get(f"{entry_name(row, c)}_{k}", 0.0) for c in columns] for row in (*RATES, *inner)]
        return np.array(rows)

    trimmed = (*(name for name in NEEDED if name not in STILL), *inner, *inputs)
    return tuple(
        SpeedPoint(
            name=f"point {k}",
            inner=inner,
            inputs=inputs,
            trim={name: values[f"trim_{name}_{k}"] for name in trimmed},
            X=table((*NEEDED, *inner), k),
            B=table(inputs, k),
            gradients={name: values[f"gradient_{name}_{k}"] for name in trimmed[1:]},
        )
        for k in range(int(card.options["points"]))
    )


def disagreement(point: SpeedPoint) -> Mapping[str, tuple[float, float]]:
    """Derivatives by speed of the body's six rows, X_u to N_u: as given, and as the trims' gradients imply them."""
    pairs = zip(point.given()[:6], point.implied()[:6], strict=True)
    return {f"{_LETTERS[row]}_u": (float(a), float(b)) for row, (a, b) in zip(RATES, pairs, strict=True)}


class StitchedVehicle(Vehicle):
    """A stitched model: prints its points, with the speed derivatives given and implied."""

    def points(self) -> tuple[SpeedPoint, ...]:
        """Its linear models with trims, slowest first."""
        return points_of(self.card)

    def __repr__(self) -> str:
        points = self.points()
        inputs = points[0].inputs
        angles = [
            f"{name} [deg]" if unit == "rad" else name for name, unit in zip(inputs, self.input_units, strict=True)
        ]
        scale = [np.degrees(1.0) if unit == "rad" else 1.0 for unit in self.input_units]
        rows = []
        for p in points:
            body = [f"{p.speed:.2f}", f"{np.degrees(p.trim['phi']):.2f}", f"{np.degrees(p.trim['theta']):.2f}"]
            rows.append([*body, *(f"{k * p.trim[name]:.4g}" for k, name in zip(scale, inputs, strict=True))])
        head = ["u [m/s]", "phi [deg]", "theta [deg]", *angles]
        lines = [super().__repr__(), "Trims:", text_table(head, rows, left=())]
        names = list(disagreement(points[0]))
        rows = []
        for p in points:
            own, implied = zip(*disagreement(p).values(), strict=True)
            rows.append([f"{p.speed:.2f}", "point", *(f"{value:.3g}" for value in own)])
            rows.append(["", "trims", *(f"{value:.3g}" for value in implied)])
        lines.append("Derivatives by speed as the point has them, and as its trims' gradients imply, which fly:")
        return "\n".join([*lines, text_table(["u [m/s]", "of", *names], rows, left=(1,)), self.card.trust])
