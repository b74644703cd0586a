"""What the sigmas of a card, and the errors of its equations, do to its derivatives and modes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from swashplate.arrays import Array
from swashplate.errors import CardError, SwashError, TrimError
from swashplate.models.catalogue import from_card
from swashplate.models.surroundings import environment_of
from swashplate.models.vehicle import Vehicle
from swashplate.physics.environment import Environment
from swashplate.simulation.derivatives import derivative_table
from swashplate.simulation.linearize import linearize
from swashplate.simulation.model_error import ModelError, model_error
from swashplate.simulation.trim import Trim, trim


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
    eigenvalues: NDArray[np.complexfloating[Any, Any]]
    samples: NDArray[np.complexfloating[Any, Any]]
    draws: int
    refused: int

    @property
    def words(self) -> str:
        """What the bounds hold, and what they do not."""
        told = {one.kind: one for one in self.model.values()}
        parts = ", ".join(f"{kind} {100.0 * one.sigma:.0f} % of {one.vehicles}" for kind, one in told.items())
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
    modes: list[NDArray[np.complexfloating[Any, Any]]] = []
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


def _matched(
    values: NDArray[np.complexfloating[Any, Any]], wanted: NDArray[np.complexfloating[Any, Any]]
) -> NDArray[np.complexfloating[Any, Any]]:
    """Eigenvalues in the order of others, by the assignment that moves them least."""
    from scipy.optimize import linear_sum_assignment

    _, order = linear_sum_assignment(np.abs(wanted[:, None] - values[None, :]))
    return np.asarray(values[order])
