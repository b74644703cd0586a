"""One continuous model from linear models at several speeds, stitched over the speed ahead (Tobias and Tischler 2016).

At air speed s ahead, between the slowest and the fastest point,

    a = -g(phi_t(s), theta_t(s)) + X(s) (x - x_t(s)) + B(s) (u - u_t(s)),    dV/dt = a + g(phi, theta) - omega x V

and the angular accelerations and inner states likewise, without gravity. Trims x_t and u_t are cubic between points and
have given gradients there; derivatives are linear. X are the points' matrices without their gravity and Coriolis
terms, which act nonlinearly; gyroscopic moments stay in the matrices, where they are zero to first order.
An effect of attitude on forces that is left beside gravity (of a bar that keeps its own) stays in X.

The speed s is that of the instant, so that the deviation of u from its trim is zero and the points' speed derivatives
X_u, M_u act nowhere between the points: what speed does comes from the trims alone. Along the trims A x_t' + B u_t' is
zero, so the model's derivative by speed is A e_u where the gradients are those of the points' own derivatives; counted
beside the gradients, X_u would act twice. Beyond the points s stays at the last one, and X_u acts on the rest.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from functools import partial
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from swashplate.arrays import Array
from swashplate.errors import CardError
from swashplate.models.card import Card
from swashplate.models.linear.card_vehicle import NEEDED, LinearState, entry_name, entry_unit, named_states, tuple_type
from swashplate.models.traits import Traits
from swashplate.models.usual_axes import usual_axes
from swashplate.models.vehicle import Vehicle
from swashplate.physics.backend import Backend, FloatBackend, Named, Scalar
from swashplate.physics.environment import LABORATORY_GRAVITY, Environment
from swashplate.physics.frames import Euler, Vector, local_to_body
from swashplate.physics.rigid_body import BODY_UNITS, Inertia, RigidBody, gravity, rigid_body_rates
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
        gradients = np.array([0.0 if name == "u" else self.gradients.get(name, 0.0) for name in self.columns])
        driven = np.array([self.gradients[name] for name in self.inputs])
        weight = np.zeros(len(self.rows))
        turned = gravity_slope(self.trim) @ [self.gradients["phi"], self.gradients["theta"]]
        weight[:3] = -turned
        return np.asarray(weight - self.X @ gradients - self.B @ driven)

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
            derivatives, implied = zip(*disagreement(p).values(), strict=True)
            rows.append([f"{p.speed:.2f}", "point", *(f"{value:.3g}" for value in derivatives)])
            rows.append(["", "trims", *(f"{value:.3g}" for value in implied)])
        lines.append("Derivatives by speed as the point has them, and as its trims' gradients imply, which fly:")
        return "\n".join([*lines, text_table(["u [m/s]", "of", *names], rows, left=(1,)), self.card.trust])


NAME = "stitched"
_OPTIONS = ("points", "inner", "inner_units", "inputs", "input_units", "low", "high", "air_density")
_DENSER = 0.05
"""Share by which the air's density may differ from the points' before it is said."""


class Stitches(NamedTuple):
    """Which numbers stand where: what compiled code depends on.

    Attributes:
        points: how many.
        inner, inputs: names of the states beside the rigid body's, and of the inputs.
        entries: (row's state, column's state or input) of every derivative.
    """

    points: int
    inner: tuple[str, ...]
    inputs: tuple[str, ...]
    entries: tuple[tuple[str, str], ...]

    @property
    def trimmed(self) -> tuple[str, ...]:
        """What has a trim at every point, the speed ahead first."""
        return (*(name for name in NEEDED if name not in STILL), *self.inner, *self.inputs)


def stitched(card: Card) -> Vehicle:
    """The stitched model of a card, as `sp.stitch` writes it.

    Raises:
        CardError: naming an option or number that is missing, unknown, does not fit, or points out of order.
    """
    where, options = card.where, card.options
    if set(options) != set(_OPTIONS):
        raise CardError(
            f"has {', '.join(options)}; expected {', '.join(_OPTIONS)}.",
            where=where,
            channel="options",
            hint="`swash vehicle stitch` writes such a card.",
        )
    n, inner, inputs = options["points"], tuple(options["inner"]), tuple(options["inputs"])
    if isinstance(n, bool) or not isinstance(n, int) or n < 2:
        raise CardError(f"is {n!r}, expected two or more.", where=where, channel="options.points")
    for one, other in (("inner_units", "inner"), ("input_units", "inputs"), ("low", "inputs"), ("high", "inputs")):
        many, wanted = (len(parts) if isinstance(parts := options[name], list | tuple) else 0 for name in (one, other))
        if many != wanted:
            raise CardError(
                f"has {many} entries, expected {wanted}, as many as {other}.", where=where, channel=f"options.{one}"
            )
    units = dict(zip(RigidBody._fields, BODY_UNITS, strict=True))
    units |= dict(zip((*inner, *inputs), (*options["inner_units"], *options["input_units"]), strict=True))
    parts = [name.removesuffix("_0").partition("_by_") for name in card.parameters if name.endswith("_0")]
    rows, columns = (*RATES, *inner), (*NEEDED, *inner, *inputs)
    entries = tuple((row, column) for row, by, column in parts if by and row in rows and column in columns)
    stitches = Stitches(n, inner, inputs, entries)
    expected: dict[str, str] = {}
    for k in range(n):
        expected |= {f"{entry_name(*e)}_{k}": entry_unit(units[e[0]], units[e[1]]) for e in entries}
        expected |= {f"trim_{name}_{k}": units[name] for name in stitches.trimmed}
        expected |= {f"gradient_{name}_{k}": gradient_unit(units[name]) for name in stitches.trimmed[1:]}
    card.checked_against(expected)
    speeds = [card.parameters[f"trim_u_{k}"].value for k in range(n)]
    if any(not slow < fast for slow, fast in pairwise(speeds)):
        listed = ", ".join(f"{speed:g}" for speed in speeds)
        raise CardError(f"are {listed} m/s, expected ascending speeds.", where=where, channel="trim_u_0 and on")
    vehicle = Vehicle(
        card=card,
        state=LinearState(RigidBody(*(0.0,) * 12), tuple_type("Inner", inner)(*(0.0,) * len(inner)) if inner else None),
        inputs=tuple_type("Inputs", inputs),
        parameters=tuple_type("Parameters", tuple(expected)),
        state_names=(*RigidBody._fields, *inner),
        state_units=(*BODY_UNITS, *options["inner_units"]),
        input_names=inputs,
        input_units=tuple(options["input_units"]),
        input_limits=tuple(zip(map(float, options["low"]), map(float, options["high"]), strict=True)),
        derivatives=partial(derivatives, stitches=stitches),
        specific_force=partial(specific_force, stitches=stitches),
        traits=replace(TRAITS, axes=usual_axes(inputs)),
    )
    return StitchedVehicle(**{f.name: getattr(vehicle, f.name) for f in fields(Vehicle)})


def gradient_unit(unit: str) -> str:
    """Unit of a trim's change with speed."""
    return f"{'1' if unit == '1' else unit}/(m/s)"


def outside(vehicle: Vehicle, x: Array, u: Array, environment: Environment) -> Mapping[str, str]:
    """What of a stitched model does not hold at a state: a speed beyond its points, another density of the air."""
    del u
    numbers, n = vehicle.card.parameters, int(vehicle.card.options["points"])
    body = RigidBody(*map(float, x[: len(RigidBody._fields)]))
    ahead = body.u - _wind(body, environment, FloatBackend()).x
    slow, fast = numbers["trim_u_0"].value, numbers[f"trim_u_{n - 1}"].value
    doubts = {}
    if not slow - _NEAR <= ahead <= fast + _NEAR:
        doubts["speed"] = (
            f"the air speed ahead is {ahead:.1f} m/s, outside the points, {slow:.1f} to {fast:.1f} m/s: "
            "trims and derivatives are held at the last one"
        )
    density = float(vehicle.card.options["air_density"])
    if abs(environment.air_density / density - 1.0) > _DENSER:
        doubts["density"] = (
            f"the air has {environment.air_density:.3g} kg/m^3, the points {density:.3g}, "
            "and their derivatives are not scaled"
        )
    return doubts


_NEAR = 0.5
"""m/s beyond the points that nobody need hear of: a hover drifts."""

TRAITS = Traits(
    remark="Stitched from points over speed: without ground or battery, held beyond the points.",
    about="Linear models at several speeds, stitched over the air speed ahead: trims and derivatives are interpolated, "
    "gravity and kinematics exact. Trusted between its points, near their trims. Sideways and vertical flight, weight "
    "and density of the air are as linear, or as fixed, as the points'. It has no ground and no battery.",
    ground=False,
    doubts=outside,
)


def _wind(body: RigidBody, env: Environment, xp: Backend) -> Vector:
    return local_to_body(env.wind, body.attitude, xp)


class Between(NamedTuple):
    """Where a speed lies among the points: shares of their trims, of the trims' gradients [m/s], of derivatives."""

    values: tuple[Scalar, ...]
    gradients: tuple[Scalar, ...]
    derivatives: tuple[Scalar, ...]

    def trim(self, par: Named, name: str) -> Scalar:
        cubic = sum(share * getattr(par, f"trim_{name}_{k}") for k, share in enumerate(self.values))
        return cubic + sum(share * getattr(par, f"gradient_{name}_{k}") for k, share in enumerate(self.gradients))


def between(speed: Scalar, par: Named, n: int, xp: Backend) -> Between:
    """Shares of cubic Hermite (trims) and linear interpolation (derivatives) at a speed between the points' [m/s]."""
    knots = [getattr(par, f"trim_u_{k}") for k in range(n)]
    values: list[Scalar] = [1.0] + [0.0] * (n - 1)
    gradients: list[Scalar] = [0.0] * n
    straight: list[Scalar] = [1.0] + [0.0] * (n - 1)
    for k, (slow, fast) in enumerate(pairwise(knots)):
        t = (speed - slow) / (fast - slow)
        # The speed lies between the first and the last; clipped twice, it would lose half its slope there.
        t = t if k == 0 else xp.maximum(t, 0.0)
        t = t if k == n - 2 else xp.minimum(t, 1.0)
        smooth = t * t * (3.0 - 2.0 * t)
        values[k], values[k + 1] = values[k] - smooth, values[k + 1] + smooth
        gradients[k] = gradients[k] + (fast - slow) * t * (1.0 - t) * (1.0 - t)
        gradients[k + 1] = gradients[k + 1] - (fast - slow) * t * t * (1.0 - t)
        straight[k], straight[k + 1] = straight[k] - t, straight[k + 1] + t
    return Between(tuple(values), tuple(gradients), tuple(straight))


def _acting(
    state: LinearState, inputs: Named, par: Named, env: Environment, xp: Backend, stitches: Stitches
) -> tuple[Vector, Vector, dict[str, Scalar]]:
    """Specific force [m/s^2], angular acceleration [rad/s^2] and the inner states' rates."""
    body = state.body
    assert body is not None
    air = body.velocity + _wind(body, env, xp).scaled(-1.0)
    here = named_states(state) | inputs._asdict() | {"u": air.x, "v": air.y, "w": air.z}
    speed = xp.minimum(xp.maximum(air.x, par.trim_u_0), getattr(par, f"trim_u_{stitches.points - 1}"))
    place = between(speed, par, stitches.points, xp)
    trims = {"u": speed} | {name: place.trim(par, name) for name in stitches.trimmed[1:]}
    away = {name: value - trims.get(name, 0.0) for name, value in here.items()}
    weight = gravity(1.0, env.gravity, Euler(trims["phi"], trims["theta"], 0.0), xp)
    rates: dict[str, Scalar] = dict.fromkeys((*RATES, *stitches.inner), 0.0)
    rates |= {"u": -weight.x, "v": -weight.y, "w": -weight.z}
    for row, column in stitches.entries:
        name = entry_name(row, column)
        slope = sum(share * getattr(par, f"{name}_{k}") for k, share in enumerate(place.derivatives))
        rates[row] = rates[row] + slope * away[column]
    felt, turned = Vector(rates["u"], rates["v"], rates["w"]), Vector(rates["p"], rates["q"], rates["r"])
    return felt, turned, rates


def derivatives(
    state: LinearState, inputs: Named, par: Named, env: Environment, xp: Backend, *, stitches: Stitches
) -> LinearState:
    """Time derivative of the whole state."""
    felt, turned, rates = _acting(state, inputs, par, env, xp, stitches)
    assert state.body is not None
    force = felt + gravity(1.0, env.gravity, state.body.attitude, xp)
    # Of a body with equal moments of inertia: the gyroscopic moments are the points'.
    body = rigid_body_rates(state.body, force, turned, Inertia(1.0, 1.0, 1.0, 1.0), xp)
    inner = None if state.inner is None else type(state.inner)(*(rates[name] for name in state.inner._fields))
    return LinearState(body, inner)


def specific_force(
    state: LinearState, inputs: Named, par: Named, env: Environment, xp: Backend, *, stitches: Stitches
) -> Vector:
    """What accelerometers at the centre of gravity read [m/s^2]."""
    return _acting(state, inputs, par, env, xp, stitches)[0]
