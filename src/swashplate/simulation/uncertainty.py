"""What the sigmas of a card do to its derivatives and modes."""

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
from swashplate.simulation.trim import Trim, trim


@dataclass(frozen=True)
class CardSpread:
    """Bounds on derivatives and eigenvalues of one trim.

    Attributes:
        derivatives: by name: value of the card, and the 5 % and 95 % quantiles.
        eigenvalues: of the card, shape (n,), [1/s].
        samples: eigenvalues of the samples, each row sorted to the card's, shape (draws, n).
        draws: how many samples could be trimmed; refused: how many could not.
    """

    derivatives: Mapping[str, tuple[float, float, float]]
    eigenvalues: NDArray[np.complexfloating[Any, Any]]
    samples: NDArray[np.complexfloating[Any, Any]]
    draws: int
    refused: int

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
    vehicle: Vehicle, at: Trim, *, draws: int = 200, seed: int = 0, environment: Environment | None = None
) -> CardSpread:
    """Samples of the card (independent, normal, within its bounds), each trimmed again, and the quantiles.

    Args:
        vehicle: a single-rotor helicopter whose card has sigmas.
        at: the trim; its speed, climb and turn are flown by every sample.
        draws: how many samples.
        seed: of the draws.
        environment: surroundings, by default the trim's.

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
    low, high = np.quantile(np.array(tables), [0.05, 0.95], axis=0)
    centre = derivative_table(vehicle, at).total.ravel()
    quantiles = {name: (float(c), float(a), float(b)) for name, c, a, b in zip(names, centre, low, high, strict=True)}
    return CardSpread(quantiles, values, np.array(modes), len(tables), refused)


def _matched(
    values: NDArray[np.complexfloating[Any, Any]], wanted: NDArray[np.complexfloating[Any, Any]]
) -> NDArray[np.complexfloating[Any, Any]]:
    """Eigenvalues in the order of others, by the assignment that moves them least."""
    from scipy.optimize import linear_sum_assignment

    _, order = linear_sum_assignment(np.abs(wanted[:, None] - values[None, :]))
    return np.asarray(values[order])
