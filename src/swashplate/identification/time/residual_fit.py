"""The linear residual of a fit: what its errors still tell, shrunk as far as flights left out demand.

Noise, filtered states and the records' constants stay where the fit has them; the residual's coefficients move, by
Gauss-Newton from zero on what the fit itself made small: its innovations (here), or its errors some time ahead
(`residual_ahead`). Of innovations the physics moves too: while it stood alone, it took over what the residual is for.
Each coefficient is held towards zero, in units in which one makes an acceleration as large as the disturbance that the
filter saw; how hard, blocks left out say (`residual_strength`). A block begins with the accelerations that its flight
has of its own (`push_*`), as the flight itself does.

Blocks tell chance from what is always there, not what causes it. Of innovations, only accelerations of axes that a
flight moves by itself have coefficients: elsewhere a steady error of a log looks like an effect of what the controller
answers with. From what was found here, the search of a fit goes on with everything free (`residual_joint`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from swashplate.arrays import Array
from swashplate.filtering.disturbances import Noise
from swashplate.filtering.nuisance import Nuisance
from swashplate.identification.core.multi_step import Horizon
from swashplate.identification.core.parameters import Free, Parameterization
from swashplate.identification.core.records import Record
from swashplate.identification.time.feedback import AxisExcitation, by_itself
from swashplate.identification.time.filter_error import FilterError
from swashplate.identification.time.linear_residual import (
    LinearResidual,
    accelerations_along,
    kept,
    none_found,
    seen_along,
    shares,
    units_of,
    with_coefficients,
)
from swashplate.identification.time.residual_ahead import (
    BLOCK,
    LeftOutBlock,
    Physics,
    chosen_strength,
    enough_blocks,
    fit_ahead,
    shrunk,
)
from swashplate.models.residual import coefficients, with_residual
from swashplate.models.vehicle import Vehicle

_AXIS = {"u": "pitch", "v": "roll", "w": "heave", "p": "roll", "q": "pitch", "r": "yaw"}
"""The axis whose commands move each acceleration."""


def fit_residual(
    vehicle: Vehicle,
    pieces: Sequence[Record],
    nuisances: Sequence[Nuisance],
    noise: Noise,
    *,
    horizon: Horizon | None = None,
    axes: Sequence[AxisExcitation] = (),
    physics: Parameterization | None = None,
) -> LinearResidual:
    """The residual of an identified vehicle.

    Args:
        vehicle: with the numbers that the fit found.
        pieces: its records. nuisances: constants of each. noise: of the filter.
        horizon: that of the fit; None: innovations.
        axes: what each record moves; accelerations of axes that none moves by itself get none (with a horizon all do:
            such a residual is the controller's answers on purpose). Empty: not judged.
        physics: what of the vehicle moves with it (not with a horizon); None: nothing.

    Raises:
        IdentificationError: where the records make fewer than `FEWEST` blocks.
        CardError: for a vehicle that cannot have one.
    """
    means = np.concatenate([piece.inputs for piece in pieces]).mean(axis=0)
    wider = with_residual(
        vehicle,
        dict(zip(vehicle.input_names, means.tolist(), strict=True)),
        ahead=0.0 if horizon is None else horizon.last,
    )
    if horizon is not None:
        constants = () if physics is None else physics.of_records
        return fit_ahead(wider, pieces, nuisances, noise, horizon=horizon, constants=constants)
    cut = [(block, nuisance) for piece, nuisance in zip(pieces, nuisances, strict=True) for block in _blocks(piece)]
    enough_blocks(len(cut), pieces[0].name)
    still = {row for row, axis in _AXIS.items() if not _moves_by_itself(axis, axes)}
    names = {name: pair for name, pair in coefficients(vehicle).items() if pair[0] not in still}
    if not names:
        return none_found(vehicle, noise, 0.0, 0.0)
    beside = () if physics is None else tuple(replace(free, start=None) for free in physics.free)
    table = Parameterization(
        wider,
        (*beside, *(Free(name, 1.0) for name in names)),
        physics.ties if physics else (),
        prior_card=physics.prior_card if physics else None,
    )
    likelihoods = [
        FilterError(
            replace(table, of_records=kept(nuisance)), [block], noise=noise, estimate_noise=False, nuisance=nuisance
        )
        for block, nuisance in cut
    ]
    columns, total = seen_along(likelihoods)
    size = units_of(names, columns, total)
    blocks, others = _one_step(likelihoods, size), _priors(likelihoods[0], len(beside))
    strength, gain, error = chosen_strength(blocks, others)
    if not np.isfinite(strength):
        return none_found(vehicle, noise, gain, error)
    away, covariance = shrunk(blocks, strength, others)
    k = len(beside)
    factors, sigma = away[k:] / size, np.sqrt(np.diag(covariance))[k:] / size
    checked = [_cost(each, np.concatenate([away[:k], factors])) for each in likelihoods]
    if not sum(checked) < sum(block.start for block in blocks):
        return none_found(vehicle, noise, gain, error)  # to second order it gained, and in fact it does not
    row = likelihoods[0].row
    low, high = row.bounds()
    at = np.clip(row.starts()[:k] + away[:k], low[:k], high[:k]) * row.scale[:k]
    told_by = table.identified(np.concatenate([at, factors]))
    shifted = wider.with_values({name: value for name, value in told_by.items() if name not in names})
    source = f"residual by {len(blocks)} blocks, ridge {strength:.3g}"
    made_of = with_coefficients(shifted, dict(zip(names, factors, strict=True)), sigma, source)
    along = columns, accelerations_along(likelihoods)
    units = dict(zip(names, (1.0 / size).tolist(), strict=True))
    return LinearResidual(made_of, strength, gain, error, shares(made_of, *along), noise, units, along)


def _moves_by_itself(axis: str, judged: Sequence[AxisExcitation]) -> bool:
    """Whether a record moves an axis by itself, or none was judged."""
    mine = [one for one in judged if one.axis == axis]
    return not mine or any(by_itself(one) for one in mine)


def _blocks(piece: Record) -> list[Record]:
    """A record cut into blocks of `BLOCK` seconds or a little more."""
    n = int((piece.time[-1] - piece.time[0]) // BLOCK)
    edges = np.linspace(0, piece.time.size, n + 1).astype(int) if n else np.zeros(1, dtype=int)
    return [
        replace(
            piece,
            name=f"{piece.name}, block {i + 1}",
            time=piece.time[a:b],
            inputs=piece.inputs[a:b],
            outputs=piece.outputs[a:b],
            voltage=piece.voltage[a:b],
        )
        for i, (a, b) in enumerate(pairwise(edges))
    ]


def _one_step(likelihoods: Sequence[FilterError], size: Array) -> list[LeftOutBlock]:
    """Innovations, linear in accelerations as small as these, and in the physics."""
    blocks = []
    for likelihood in likelihoods:
        cost, gradient, information = likelihood.scores(likelihood.row.starts())
        places = likelihood.row.places("parameter")
        scale = np.concatenate([np.ones(places.size - size.size), 1.0 / size])
        hessian = information[np.ix_(places, places)] * np.outer(scale, scale)
        blocks.append(LeftOutBlock(cost, np.zeros(places.size), cost, gradient[places] * scale, hessian))
    return blocks


def _priors(likelihood: FilterError, k: int) -> Physics:
    """Of the first k parameters of a row, where they stand."""
    _, pull, information = likelihood.row.prior(likelihood.row.starts())
    return Physics(pull[:k], information[:k, :k])


def _cost(likelihood: FilterError, away: Array) -> float:
    """Cost of the innovations with physics moved, and at coefficients, whose scale in the row is one."""
    row = likelihood.row.starts()
    row[likelihood.row.places("parameter")] += away
    low, high = likelihood.row.bounds()
    return likelihood.cost(np.clip(row, low, high))
