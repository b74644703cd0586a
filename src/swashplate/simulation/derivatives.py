"""The table of derivatives by exact slopes of the nonlinear equations.

What the sigmas of a card, and the errors of its equations, do to its derivatives and modes.

What a blade-element model of a helicopter misses in its derivatives, as published helicopters have shown it.

A card may be right in every number, and its derivatives are still off: wake on the fuselage, interference, blades that
bend, inflow that is slower or uneven. How far off is measured: derivatives of four helicopters of which the geometry is
known, held against published ones (`tests/oracle/test_model_error.py` has the sources and works these numbers out).
Two are from flights of small helicopters, two from larger models of full-size ones.
"""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from swashplate.arrays import Complex
from swashplate.engine.equations import SURROUNDINGS, Equations, equations_of, parameter_row, unpack_rows
from swashplate.engine.slopes import Slopes, slopes_of
from swashplate.errors import SwashError
from swashplate.models.conventional.derivative_table import COLUMNS, CONTROLS, MOTIONS, DerivativeTable
from swashplate.models.conventional.helicopter import CONTRIBUTORS, loads
from swashplate.models.conventional.helicopter_options import HelicopterOptions
from swashplate.models.nesting import leaves, rebuild
from swashplate.models.vehicle import Vehicle
from swashplate.physics.backend import Backend
from swashplate.simulation.trim import Trim

if TYPE_CHECKING:
    from swashplate.engine.equations import Rows
from collections.abc import Mapping
from dataclasses import dataclass

from scipy.special import stdtrit

from swashplate.arrays import Array
from swashplate.errors import CardError, TrimError
from swashplate.models.catalogue import from_card
from swashplate.models.conventional.derivative_table import ROWS, split_name
from swashplate.models.surroundings import environment_of
from swashplate.physics.environment import Environment
from swashplate.simulation.linearize import linearize
from swashplate.simulation.trim import trim

MEASURED: Mapping[str, Mapping[str, float]] = {
    "heave": {"UH-60A": 0.05, "Lynx": 0.03, "R-50": 0.37, "HeLion": 0.02},
    "forces by speed": {"UH-60A": 0.34, "Lynx": 0.15, "R-50": 0.54, "HeLion": 1.57},
    "roll and pitch by speed": {"Lynx": 0.07, "R-50": 1.31, "HeLion": 0.69},
    "roll and pitch by rates": {"UH-60A": 0.49, "Lynx": 0.03, "HeLion": 1.06},
    "yaw and tail rotor": {"UH-60A": 0.28, "Lynx": 0.14},
    "other controls": {"Lynx": 0.02},
}
"""Root mean square of published less ours, over ours, by kind of derivative and helicopter."""

_QUANTILES = (np.arange(40) + 0.5) / 40
"""Of the model's error, where samples of a card are multiplied by it."""


@dataclass(frozen=True)
class ModelError:
    """How far a kind of derivative is off.

    Attributes:
        kind: of the derivative. sigma: standard deviation over the value; NaN where no helicopter told it.
        vehicles: how many helicopters told it.
    """

    kind: str
    sigma: float
    vehicles: int

    def widened(self, samples: Array) -> tuple[float, float]:
        """5 % and 95 % quantiles of samples of a derivative (n,) that is off by this, too.

        So few helicopters tell a standard deviation that the error has Student's distribution, with one degree of
        freedom for each. Where none told it, the samples' own quantiles.
        """
        factors = np.ones(1)
        if self.vehicles:
            factors = 1.0 + self.sigma * stdtrit(self.vehicles, _QUANTILES)
        low, high = np.quantile(np.outer(samples, factors), [0.05, 0.95])
        return float(low), float(high)


def model_error(name: str, *, without: str = "") -> ModelError:
    """The model's error of a derivative.

    Args:
        name: of the derivative, as "Lp". without: a helicopter that is not to be counted, so that it can judge.

    Raises:
        SwashError: where there is no such derivative.
    """
    kind = kind_of(name)
    errors = [value for vehicle, value in MEASURED[kind].items() if vehicle != without]
    sigma = float(np.sqrt(np.mean(np.square(errors)))) if errors else float("nan")
    return ModelError(kind, sigma, len(errors))


def kind_of(name: str) -> str:
    """The kind of a derivative, a key of `MEASURED`.

    Raises:
        SwashError: where there is no such derivative.
    """
    place = split_name(name)
    row, column = ROWS[place[0]], COLUMNS[place[1]]
    if row == "Z" and column in ("w", "theta0"):
        return "heave"
    if row == "N" or column == "theta0T" or (row, column) == ("Y", "r"):
        return "yaw and tail rotor"
    if column in ("u", "v", "w"):
        return "forces by speed" if row in "XYZ" else "roll and pitch by speed"
    return "roll and pitch by rates" if column in ("p", "q", "r") else "other controls"


@dataclass(frozen=True)
class CardSpread:
    """Bounds on derivatives and eigenvalues of one trim.

    Attributes:
        derivatives: by name: value of the card, and the 5 % and 95 % quantiles, with the error of the model.
        by_card: the quantiles that the card's sigmas alone give. model: the error of the model.
        eigenvalues: of the card, shape (n,), [1/s].
        samples: eigenvalues of the samples, each row sorted to the card's, shape (draws, n).
        draws: how many samples could be trimmed; refused: how many could not.
    """

    derivatives: Mapping[str, tuple[float, float, float]]
    by_card: Mapping[str, tuple[float, float]]
    model: Mapping[str, ModelError]
    eigenvalues: Complex
    samples: Complex
    draws: int
    refused: int

    @property
    def words(self) -> str:
        """What the bounds hold, and what they do not."""
        errors = {one.kind: one for one in self.model.values()}
        parts = ", ".join(f"{kind} {100.0 * one.sigma:.0f} % of {one.vehicles}" for kind, one in errors.items())
        return (
            f"5 % and 95 % bounds: of {self.draws} samples of the card ({self.refused} could not be trimmed), and of "
            f"what such a model misses beside published helicopters (standard deviation, told by how many: {parts}). "
            "The modes' bounds have the card's samples in them alone."
        )

    def modes(self) -> list[dict[str, dict[str, float]]]:
        """Every mode of the card with the 5 % and 95 % quantiles of the samples' [1/s], fastest first."""
        rows = []
        for i in np.argsort(-np.abs(self.eigenvalues), kind="stable"):
            value, drawn = self.eigenvalues[i], self.samples[:, i]
            if value.imag < 0.0 or abs(value) < 1e-6:
                continue
            real, imag = np.quantile(drawn.real, [0.05, 0.95]), np.quantile(np.abs(drawn.imag), [0.05, 0.95])
            rows.append(
                {
                    "real": {"value": value.real, "5 %": real[0], "95 %": real[1]},
                    "imag": {"value": value.imag, "5 %": imag[0], "95 %": imag[1]},
                }
            )
        return rows


def spread(
    vehicle: Vehicle,
    at: Trim,
    *,
    draws: int = 200,
    seed: int = 0,
    environment: Environment | None = None,
    without: str = "",
) -> CardSpread:
    """Samples of the card (independent, normal, within its bounds), each trimmed again, and the quantiles.

    Each derivative is off by the model's error, too (`model_error`).

    Args:
        vehicle: a single-rotor helicopter whose card has sigmas.
        at: the trim; its speed, climb and turn are flown by every sample.
        draws: how many samples.
        seed: of the draws.
        environment: surroundings, by default the trim's.
        without: a helicopter whose published derivatives are not to count for the model's error.

    Raises:
        SwashError: where no parameter has a sigma.
    """
    card = vehicle.card
    uncertain = {name: p for name, p in card.parameters.items() if p.sigma}
    if not uncertain:
        raise SwashError("no parameter of the card has a sigma.", where=card.where)
    around = environment_of(vehicle, environment or at.environment)
    rng = np.random.default_rng(seed)
    nominal = linearize(vehicle, at)
    values = np.linalg.eigvals(nominal.A).astype(complex)
    tables: list[Array] = []
    modes: list[Complex] = []
    refused, why = 0, ""
    names = list(derivative_table(vehicle, at).names())
    for _ in range(draws):
        drawn = {
            name: float(
                np.clip(
                    rng.normal(p.value, p.sigma or 0.0),
                    -np.inf if p.lower is None else p.lower,
                    np.inf if p.upper is None else p.upper,
                )
            )
            for name, p in uncertain.items()
        }
        try:
            other = from_card(card.with_values(drawn))
            there = trim(
                other,
                speed=at.speed,
                lateral=at.lateral,
                climb=at.climb,
                turn=at.turn,
                environment=around,
                near=at,
            )
        except (CardError, TrimError) as error:
            refused, why = refused + 1, str(error)
            continue
        tables.append(derivative_table(other, there).total.ravel())
        modes.append(_matched(np.linalg.eigvals(linearize(other, there).A).astype(complex), values))
    if not tables:
        raise SwashError(f"none of the samples could be trimmed; the last: {why}", where=card.where)
    samples = np.array(tables)
    low, high = np.quantile(samples, [0.05, 0.95], axis=0)
    centre = derivative_table(vehicle, at).total.ravel()
    model = {name: model_error(name, without=without) for name in names}
    return CardSpread(
        derivatives={n: (float(centre[i]), *model[n].widened(samples[:, i])) for i, n in enumerate(names)},
        by_card={n: (float(low[i]), float(high[i])) for i, n in enumerate(names)},
        model=model,
        eigenvalues=values,
        samples=np.array(modes),
        draws=len(tables),
        refused=refused,
    )


def _matched(values: Complex, wanted: Complex) -> Complex:
    """Eigenvalues in the order of others, by the assignment that moves them least."""
    from scipy.optimize import linear_sum_assignment

    _, order = linear_sum_assignment(np.abs(wanted[:, None] - values[None, :]))
    return np.asarray(values[order])


_FAST = ("a1", "b1", "lam0", "lam_c", "lam_s")
"""States that follow without delay in a table of derivatives with six degrees of freedom."""


def derivative_table(vehicle: Vehicle, trim: Trim) -> DerivativeTable:
    """All derivatives of forces and moments about a trim, by contributor, exactly.

    Flapping and dynamic inflow are residualised (their rates set to zero); bar, servos, gyro and rotor speed are held.

    Raises:
        SwashError: for a vehicle that is no single-rotor helicopter.
    """
    if not isinstance(vehicle.options, HelicopterOptions):
        raise SwashError("has no table of derivatives.", where=vehicle.name, hint="It needs a single-rotor card.")
    surroundings = [float(getattr(trim.environment, name)) for name in SURROUNDINGS]
    w = np.array([*trim.inputs, *surroundings])
    numbers = parameter_row(vehicle, trim.environment)
    _, by_x, by_w = _slopes(equations_of(vehicle))(np.asarray(trim.state), w, numbers)
    fast = [vehicle.index(name) for name in _FAST if name in vehicle.state_names]
    motions = [vehicle.index(name) for name in MOTIONS]
    controls = [vehicle.input_names.index(name) for name in CONTROLS]
    if "theta0_servo" in vehicle.state_names:
        direct = by_x[:, [vehicle.index(f"{name}_servo") for name in CONTROLS]]
    else:
        direct = by_w[:, controls]
    columns = np.concatenate([by_x[:, motions], direct], axis=1)
    n = 6 * len(CONTRIBUTORS)
    following = np.asarray(-np.linalg.solve(by_x[n:, fast], columns[n:]), dtype=np.float64)
    columns = columns[:n] + by_x[:n, fast] @ following
    par = vehicle.values()
    scale = np.array([par.mass] * 3 + [par.inertia_xx, par.inertia_yy, par.inertia_zz])[:, None]
    blocks = columns.reshape(len(CONTRIBUTORS), 6, len(COLUMNS)) / scale
    parts = {name: block for name, block in zip(CONTRIBUTORS, blocks, strict=True) if name != "ground" or block.any()}
    return DerivativeTable(parts, following[:2], "automatic differentiation")


@lru_cache(maxsize=16)
def _slopes(equations: Equations) -> Slopes:
    vehicle = equations.vehicle
    sizes = (len(vehicle.state_names), len(vehicle.input_names) + 4, len(vehicle.parameter_names) + 2)

    def acting(x: Rows, w: Rows, p: Rows, xp: Backend) -> list[Any]:
        return _acting(equations, x, w, p=p, xp=xp)

    return slopes_of(acting, sizes, where=vehicle.name)


def _acting(equations: Equations, x: Rows, w: Rows, *, p: Rows, xp: Backend) -> list[Any]:
    """Forces and moments by contributor, and the rates of disc and inflow; rows as of `engine.trace.traced_rates`."""
    vehicle = equations.vehicle
    inputs, parameters, environment = unpack_rows(equations, w, p)
    state = rebuild(vehicle.state, [x[i] for i in range(len(vehicle.state_names))])
    commands = vehicle.inputs(*(inputs[i] for i in range(len(vehicle.input_names))))
    load = loads(state, commands, parameters, environment, xp, options=vehicle.options)
    rows = []
    for name in CONTRIBUTORS:
        part = getattr(load, name)
        rows += [0.0] * 6 if part is None else [*part.force, *part.moment]
    return [*rows, *leaves(load.disc), *leaves(load.inflow)]
