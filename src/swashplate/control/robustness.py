"""One controller on many aircraft: models drawn from what an identification does not know, flown in closed loop."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from swashplate.errors import ControllerError
from swashplate.identification.fit import Fit
from swashplate.simulation.batch import Batch
from swashplate.vehicles.vehicle import Vehicle

Array = NDArray[np.float64]

PERCENTILES = (5.0, 50.0, 95.0, 100.0)
SENSOR_NOISE: Mapping[str, float] = {
    **dict.fromkeys(("x", "y", "z"), 0.002),
    **dict.fromkeys(("u", "v", "w"), 0.02),
    **dict.fromkeys(("phi", "theta", "psi"), 0.005),
    **dict.fromkeys(("p", "q", "r"), 0.01),
}
"""White noise on each sample of what a controller is told [m, m/s, rad, rad/s]; assumed, as of cameras and gyros."""
_TRIES = 100


def draw_models(
    vehicle: Vehicle, fit: Fit | str | Path, *, count: int, seed: int, corrected: bool = True
) -> dict[str, Array]:
    """Parameters of aircraft that the data of a fit cannot tell from the identified one, shape (count,) each.

    Drawn about the estimates from their covariance (corrected for coloured residuals); a draw outside a bound of
    physics is drawn again. Ties are kept where they equate two parameters; other tied ones stay at the card's value.

    Args:
        vehicle: whose bounds hold.
        fit: a `Fit`, or the `fit.json` beside a model file.
        count: how many.
        seed: of the draws.
        corrected: False takes the plain Cramér-Rao covariance, which is too sure of itself.

    Raises:
        ControllerError: where the file is no fit, or its covariance lies mostly outside the bounds of physics.
    """
    document = fit.as_dict() if isinstance(fit, Fit) else read_fit(fit, kind="fit", writer="swash identify")
    names = [str(name) for name in document["names"]]
    estimates = {entry["name"]: entry for entry in document["parameters"]}
    mean = np.array([estimates[name]["value"] for name in names])
    covariance = np.asarray(document["covariance_corrected" if corrected else "covariance"], dtype=np.float64)
    low, high = (
        np.array([default if (bound := getattr(vehicle.card.parameters[n], side)) is None else bound for n in names])
        for side, default in (("lower", -np.inf), ("upper", np.inf))
    )
    found = normal_within(
        mean, covariance, low, high, count=count, seed=seed, where=str(vehicle.card.path or vehicle.name)
    )
    drawn = {name: found[:, i] for i, name in enumerate(names)}
    for name, entry in estimates.items():
        if entry.get("tie") in drawn:
            drawn[name] = drawn[entry["tie"]]
    return drawn


def normal_within(
    mean: Array, covariance: Array, low: Array, high: Array, *, count: int, seed: int, where: str
) -> Array:
    """Normal draws, shape (count, n); one outside the bounds is drawn again.

    Args:
        mean, low, high: shape (n,).
        covariance: shape (n, n).
        count, seed: of the draws.
        where: named in the message.

    Raises:
        ControllerError: where the distribution lies mostly outside the bounds.
    """
    random = np.random.default_rng(seed)
    scale = np.sqrt(np.diag(covariance))
    values, vectors = np.linalg.eigh(covariance / np.outer(scale, scale))
    root = scale[:, None] * vectors * np.sqrt(np.maximum(values, 0.0))
    found = np.empty((0, len(mean)))
    for _ in range(_TRIES):
        tried = mean + random.standard_normal((count, len(mean))) @ root.T
        found = np.concatenate([found, tried[np.all((tried >= low) & (tried <= high), axis=1)]])[:count]
        if len(found) == count:
            return found
    raise ControllerError(
        f"only {len(found)} of {count * _TRIES} draws lie within the bounds of physics.",
        where=where,
        hint="The fit knows too little; fix parameters or add data.",
    )


def read_fit(path: str | Path, *, kind: str, writer: str) -> dict[str, Any]:
    """The document of a fit.json.

    Args:
        path: the file.
        kind: what it must be.
        writer: the command that writes such files.

    Raises:
        ControllerError: where it cannot be read or is something else.
    """
    try:
        document = json.loads(Path(path).read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise ControllerError("there is no such file.", where=path, hint="Check the path.") from None
    except (OSError, UnicodeDecodeError, json.JSONDecodeError) as error:
        raise ControllerError(f"cannot be read as a fit: {error}.", where=path) from None
    if not isinstance(document, dict) or document.get("kind") != kind:
        found = document.get("kind") if isinstance(document, dict) else None
        raise ControllerError(
            f"is no fit of this model's kind (found {found!r}, expected '{kind}').",
            where=path,
            hint=f"`{writer} --out DIR` writes DIR/fit.json.",
        )
    return document


@dataclass(frozen=True)
class Spread:
    """What many flights did.

    Attributes:
        flights: how many; of them `lost` left the finite numbers or the room.
        figures: by name the percentiles `PERCENTILES` over the flights that were not lost.
        worst: number of the flight that went furthest from its reference, lost ones first; replay it by
            `Batch.flight`.
    """

    flights: int
    lost: int
    figures: Mapping[str, tuple[float, ...]]
    worst: int

    def __repr__(self) -> str:
        lines = [f"{self.flights} flights, {self.lost} lost; worst is number {self.worst}"]
        lines.append(f"  {'':<22}" + "".join(f"{f'{p:g} %':>10}" for p in PERCENTILES))
        lines += [f"  {name:<22}" + "".join(f"{v:10.4g}" for v in values) for name, values in self.figures.items()]
        return "\n".join(lines)


def spread(batch: Batch, *, x: float = 0.0, y: float = 0.0, z: float = 0.0, room: float = 10.0) -> Spread:
    """Summary of flights that should have held a place.

    Args:
        batch: from `simulate_closed_loops`.
        x, y, z: the place [m].
        room: distance from it beyond which a flight counts as lost [m].
    """
    distance = np.sqrt((batch["x"] - x) ** 2 + (batch["y"] - y) ** 2 + (batch["z"] - z) ** 2)
    furthest = np.max(np.where(np.isfinite(distance), distance, np.inf), axis=0)
    held = furthest < room
    figures = {}
    if np.any(held):
        level = np.hypot(batch["x"] - x, batch["y"] - y)[:, held]
        series = {
            "place, rms [m]": np.sqrt(np.mean(level**2, axis=0)),
            "place, largest [m]": np.max(level, axis=0),
            "height, largest [m]": np.max(np.abs(batch["z"][:, held] - z), axis=0),
            "heading, largest [deg]": np.degrees(np.max(np.abs(batch["psi"][:, held]), axis=0)),
            "lean, largest [deg]": np.degrees(
                np.max(np.maximum(np.abs(batch["phi"][:, held]), np.abs(batch["theta"][:, held])), axis=0)
            ),
        }
        figures = {n: tuple(float(v) for v in np.percentile(values, PERCENTILES)) for n, values in series.items()}
    return Spread(len(batch), int(np.sum(~held)), figures, int(np.argmax(furthest)))
