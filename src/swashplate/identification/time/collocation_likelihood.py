"""The likelihood of records with the states as unknowns of every sample, integrated out.

With a path of states x, defects w and errors v of `collocation_equations`, their standard deviations q sqrt(dt) and r,
and H the Hessian of half the exponent by the path (Gauss-Newton's),

    -log p(y) = |w / (q sqrt dt)|^2 / 2 + |v / r|^2 / 2 + (n - 1) sum log(q sqrt dt) + n sum log r
                - sum log |det dw(k)/dx(k+1)| + log det H / 2

at the path that makes the squares least: the variational bound of a Gaussian density of the states (Dutra 2025, arXiv
2510.26496), exact where the equations are linear in the states, and otherwise to second order in the states' spread.
The determinants of the defects are those without which the discretised density is none (Dutra, Teixeira and Aguirre
2014). Gradient and information are those of the innovations of a Kalman filter linear along the path: the same
likelihood, factored sample by sample.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from swashplate.arrays import Array
from swashplate.errors import IdentificationError
from swashplate.identification.core.banded_least_squares import (
    Border,
    Chain,
    Eliminated,
    eliminated,
    factor,
    half_log_determinant,
    solved,
)
from swashplate.identification.core.comparison import Comparison
from swashplate.identification.core.parameter_row import Entry, Row
from swashplate.identification.core.records import Record
from swashplate.identification.time.collocation_begin import noise_entry, rough_noise, step_within
from swashplate.identification.time.collocation_equations import (
    NOWHERE,
    CollocationPlan,
    Innovations,
    Numbers,
    Predictor,
    chain_at,
    innovations_along,
    innovations_moved,
    moved_by_numbers,
    rate_slopes,
)
from swashplate.jax_on_demand import jnp
from swashplate.simulation.dynamics import enable_double_precision

_GUST = 0.3
"""First guess: share of a state's size by which its rate is disturbed."""

_SETTLED = 1e-7
"""Gain in the exponent that is left when a path is taken for the best."""

_JOINT_STEPS, _PATH_STEPS, _HOPELESS = 100, 50, 1e8
"""Of stage 1 and of a path, at most; damping at which no descent is left."""

_SMALL_GAIN = 1e-3
"""In the joint exponent: too small for stage 1 to go on for."""

_NO_TRACE = 1e-12
"""Information per squared scale below which nothing moves with a parameter."""

_AT_ONCE = 8
"""Entries of the row whose slopes are taken side by side: bounds the memory."""


@dataclass(frozen=True)
class _Path:
    """The most probable states of a record (n, s), half the exponent there, and what else the likelihood has of it."""

    x: Array
    cost: float
    volume: float


class CollocationErrors:
    """The likelihood of records with the states integrated out; the row has parameters, constants and noise.

    Args:
        predicts: the model. states, outputs: names.
        entries: of the model's free parameters. records: what was measured.
        given: numbers that stay, beside each record's own. rest: where states are that are not measured.
        driving: of every record, (n, n_driving).
        shifts: constants in the states' rates, per record. biases: outputs with a constant per record.

    Raises:
        IdentificationError: where the equations have no value at the start, a parameter leaves no trace there, or the
            outputs do not tell the states.
    """

    def __init__(
        self,
        predicts: Predictor,
        entries: Sequence[Entry],
        *,
        states: Sequence[str],
        outputs: Sequence[str],
        records: Sequence[Record],
        given: Numbers,
        driving: Sequence[Array],
        rest: Mapping[str, float],
        shifts: bool,
        biases: Sequence[str],
    ) -> None:
        enable_double_precision()
        self.states, self.outputs, self.records = tuple(states), tuple(outputs), tuple(records)
        every = np.concatenate([record.outputs for record in records])
        around = dict(zip(outputs, map(float, np.std(every, axis=0) + 1e-12), strict=True))
        size = {s: around.get(s, abs(rest.get(s, 0.0)) or 1.0) for s in states}
        made = list(entries)
        for k in range(len(records)):
            made += [Entry(f"shift {s}[{k}]", "nuisance", 0.0, 0.1 * size[s]) for s in (states if shifts else ())]
            made += [Entry(f"bias {o}[{k}]", "nuisance", 0.0, 0.1 * around[o]) for o in biases]
        self._count = len(made)  # of what is no noise
        place = {entry.name: i for i, entry in enumerate(made)}
        made += [noise_entry(f"gust {s}", _GUST * size[s], size[s]) for s in states]
        made += [
            noise_entry(f"noise {o}", rough, around[o]) for o, rough in zip(outputs, rough_noise(records), strict=True)
        ]
        self._row = Row(tuple(made))
        self._plans = tuple(
            CollocationPlan(
                predicts,
                round(record.dt, 9),
                tuple(place.get(f"shift {s}[{k}]", NOWHERE) for s in states),
                tuple(place.get(f"bias {o}[{k}]", NOWHERE) for o in outputs),
            )
            for k, record in enumerate(records)
        )
        self._given = tuple(
            {
                **given,
                "size": jnp.asarray([size[s] for s in states]),
                "time": jnp.asarray(record.time - record.time[0]),
                "driving": jnp.asarray(w),
                "outputs": jnp.asarray(record.outputs),
            }
            for record, w in zip(records, driving, strict=True)
        )
        column = {name: i for i, name in enumerate(outputs)}
        first = [
            np.stack(
                [r.outputs[:, column[s]] if s in column else np.full(len(r.time), rest.get(s, 0.0)) for s in states], 1
            )
            for r in records
        ]
        numbers, scale, self._paths = self._together(first)
        self._tried: tuple[bytes, tuple[_Path, ...]] | None = None
        made[: self._count] = [replace(e, scale=float(s)) for e, s in zip(made, scale, strict=False)]
        self._row = Row(tuple(made))
        self.begin = np.concatenate([numbers, self._row.column("start")[self._count :]]) / self._row.scale
        self._accepted = self.begin

    @property
    def row(self) -> Row:
        return self._row

    def _split(self, row: Array) -> tuple[Array, Array]:
        """Numbers of the model and the records, and the noise."""
        plain = np.asarray(row * self._row.scale)
        return plain[: self._count], np.exp(plain[self._count :])

    def _chain(self, k: int, numbers: Array, x: Array) -> Chain:
        parts = chain_at(self._plans[k], self._given[k], jnp.asarray(numbers), jnp.asarray(x))
        return Chain(*map(np.asarray, parts))

    def _deviations(self, k: int, noise: Array) -> tuple[Array, Array]:
        """Standard deviations of defects and errors."""
        s = len(self.states)
        return noise[:s] * np.sqrt(self._plans[k].dt), noise[s:]

    # ---- stage 1: states and parameters together -----------------------------------------------------------------
    def _together(self, paths: Sequence[Array]) -> tuple[Array, Array, tuple[Array, ...]]:
        """Numbers, their scales and paths that fit best together at the first guess of the noise."""
        count, row = self._count, self._row
        low, high = row.column("lower")[:count], row.column("upper")[:count]
        numbers, noise = np.clip(row.column("start")[:count], low, high), np.exp(row.column("start")[count:])
        scale = row.scale[:count]
        prior = row.prior_information[:count, :count] / scale / scale[:, None]
        mean, damping = row.column("mean")[:count], 1e-3

        def judged(numbers: Array, paths: Sequence[Array]) -> tuple[float, list[Chain]]:
            chains = [self._chain(k, numbers, x).divided(*self._deviations(k, noise)) for k, x in enumerate(paths)]
            away = numbers - mean
            cost = sum(chain.cost for chain in chains) + 0.5 * float(away @ prior @ away)
            return (cost if np.isfinite(cost) else np.inf), chains

        cost, chains = judged(numbers, paths)
        if cost == np.inf:
            raise IdentificationError(
                "the equations have no finite value at the first guess.",
                hint="Check units and signs with 'swash inspect', or start from a card that flies.",
            )
        borders = self._bordered(numbers, noise, chains, paths)
        for _ in range(_JOINT_STEPS):
            reduced = eliminated(borders, damping)
            if reduced is None:
                damping = max(10.0 * damping, 1e-8)
                if damping > _HOPELESS:
                    break
                continue
            matrix = reduced.information + prior + np.diag(damping * reduced.diagonal + 1e-300)
            step = step_within(matrix, -(reduced.pull + prior @ (numbers - mean)), low - numbers, high - numbers)
            moved = [x + d.reshape(x.shape) for x, d in zip(paths, reduced.states(step), strict=True)]
            then, those = judged(numbers + step, moved)
            if then < cost:
                gained, cost, numbers, paths, chains = cost - then, then, numbers + step, moved, those
                borders, damping = self._bordered(numbers, noise, chains, paths), max(0.1 * damping, 1e-14)
                if gained < _SMALL_GAIN:
                    break
            else:
                damping *= 10.0
                if damping > _HOPELESS:
                    break
        reduced = eliminated(borders)
        if reduced is None:
            raise IdentificationError(
                "the outputs do not tell every state.",
                channel=", ".join(self.outputs),
                hint="Give more outputs, or leave out states that show in none.",
            )
        self._refuse_traceless(reduced, prior)
        spread = np.sqrt(np.maximum(np.diag(np.linalg.pinv(reduced.information + prior, hermitian=True)), 0.0))
        return numbers, np.maximum(np.abs(numbers), np.clip(spread, 1e-3 * scale, 1e3 * scale)), tuple(paths)

    def _bordered(self, numbers: Array, noise: Array, chains: Sequence[Chain], paths: Sequence[Array]) -> list[Border]:
        made = []
        for k, (chain, x) in enumerate(zip(chains, paths, strict=True)):
            ways = jnp.eye(self._count)
            w, v = moved_by_numbers(self._plans[k], self._given[k], jnp.asarray(numbers), jnp.asarray(x), ways)
            gust, sensor = self._deviations(k, noise)
            made.append(Border(chain, np.moveaxis(np.asarray(w), 0, 2) / gust[:, None],
                               np.moveaxis(np.asarray(v), 0, 2) / sensor[:, None]))  # fmt: skip
        return made

    def _refuse_traceless(self, reduced: Eliminated, prior: Array) -> None:
        scale = self._row.scale[: self._count]
        blind = (reduced.diagonal + np.diag(prior)) * scale**2 < _NO_TRACE
        names = [n for n, b in zip(self._row.names, blind, strict=False) if b]
        if names:
            raise IdentificationError(
                "leaves no trace where the search begins.",
                channel=", ".join(names),
                hint="Start it (or what it multiplies) from another value than zero, fix it, or give it a prior.",
            )

    # ---- stage 2: the states integrated out ----------------------------------------------------------------------
    def _settled(self, k: int, numbers: Array, noise: Array, x: Array) -> _Path | None:
        """The most probable states of a record, by damped Gauss-Newton; None where there are none."""
        deviations, damping = self._deviations(k, noise), 0.0
        raw = self._chain(k, numbers, x)
        chain = raw.divided(*deviations)
        for _ in range(_PATH_STEPS):
            factored = factor(chain.band(), damping) if np.isfinite(chain.cost) else None
            if factored is None:
                return None
            step = -solved(factored, chain.pulled(chain.w, chain.v)).reshape(x.shape)
            there = self._chain(k, numbers, x + step)
            trial = there.divided(*deviations)
            if trial.cost <= chain.cost * (1.0 + 1e-13):
                gained, x, raw, chain = chain.cost - trial.cost, x + step, there, trial
                damping = 0.1 * damping if damping > 1e-6 else 0.0
                if gained < _SETTLED:
                    break
            elif damping > _HOPELESS or chain.cost * 1e-13 + _SETTLED > abs(trial.cost - chain.cost):
                break
            else:
                damping = max(10.0 * damping, 1e-4)
        factored = factor(chain.band())
        if factored is None:
            return None
        n = len(x)
        volume = (n - 1) * np.log(deviations[0]).sum() + n * np.log(deviations[1]).sum()
        volume += half_log_determinant(factored) - np.linalg.slogdet(raw.after)[1].sum()
        return _Path(x, chain.cost, float(volume))

    def _paths_at(self, row: Array) -> tuple[_Path, ...] | None:
        key = row.tobytes()
        if self._tried is None or self._tried[0] != key:
            numbers, noise = self._split(row)
            paths = []
            for k, x in enumerate(self._paths):
                path = self._settled(k, numbers, noise, x)
                if path is None:
                    return None
                paths.append(path)
            self._tried = key, tuple(paths)
        return self._tried[1]

    def sized(self, row: Array) -> Array:
        """The row itself: its noise has its size."""
        return row

    def refresh(self, row: Array) -> None:
        """Paths of an accepted row are where the next ones begin."""
        paths = self._paths_at(row)
        if paths is not None:
            self._paths, self._accepted = tuple(path.x for path in paths), np.array(row)

    def cost(self, row: Array) -> float:
        """Negative log-likelihood of the outputs, without constants."""
        paths = self._paths_at(row)
        return np.inf if paths is None else sum(path.cost + path.volume for path in paths)

    def _filtered(self, row: Array) -> list[Innovations]:
        numbers, noise = self._split(row)
        return [
            Innovations(
                *map(
                    np.asarray,
                    innovations_along(plan, given, jnp.asarray(numbers), jnp.log(noise), jnp.asarray(path.x)),
                )
            )
            for plan, given, path in zip(self._plans, self._given, self._paths_at(row) or (), strict=True)
        ]

    def _moved(self, row: Array) -> list[tuple[Array, Array]]:
        """Slopes of every record's innovations and variances by the row's entries, (p, n, o) each."""
        numbers, noise = self._split(row)
        at, ways = (jnp.asarray(numbers), jnp.log(noise)), np.diag(self._row.scale)
        padded = np.pad(ways, ((0, -len(ways) % _AT_ONCE), (0, 0)))  # one size, compiled once
        made = []
        for plan, given, path in zip(self._plans, self._given, self._paths_at(row) or (), strict=True):
            parts = []
            for some in np.split(padded, len(padded) // _AT_ONCE):
                way = (jnp.asarray(some[:, : self._count]), jnp.asarray(some[:, self._count :]))
                parts.append([np.asarray(p) for p in innovations_moved(plan, given, at, jnp.asarray(path.x), way)])
            nu, variance = (np.concatenate(each)[: len(ways)] for each in zip(*parts, strict=True))
            made.append((nu, variance))
        return made

    def scores(self, row: Array) -> tuple[float, Array, Array]:
        """Cost, gradient and Fisher information (Ljung 1999, sec. 9.4)."""
        p = len(self._row)
        gradient, information = np.zeros(p), np.zeros((p, p))
        for seen, (nu, variance) in zip(self._filtered(row), self._moved(row), strict=True):
            white, flat = seen.innovation / seen.variance, nu.reshape(p, -1)
            share = (variance / seen.variance).reshape(p, -1)
            gradient += flat @ white.ravel() + 0.5 * share @ (1.0 - seen.innovation * white).ravel()
            information += (flat / seen.variance.ravel()) @ flat.T + 0.5 * share @ share.T
        return self.cost(row), gradient, information

    # ---- what the accuracy analysis and the report need ------------------------------------------------------------
    def whitened(self, row: Array) -> tuple[list[Array], list[Array], Array]:
        """Per record: whitened innovations (n, o), their slopes (p, n, o); and the information in their variances."""
        white, slopes, rest = [], [], np.zeros((len(self._row), len(self._row)))
        for seen, (nu, variance) in zip(self._filtered(row), self._moved(row), strict=True):
            white.append(seen.innovation / np.sqrt(seen.variance))
            slopes.append(nu / np.sqrt(seen.variance))
            share = (variance / seen.variance).reshape(len(self._row), -1)
            rest += 0.5 * share @ share.T
        return white, slopes, rest

    def fastest(self, row: Array) -> tuple[complex, float]:
        """The mode [1/s] that steps of collocation get most wrong half way along the first path, and by how much.

        A step multiplies a mode z = lambda dt by (1 + z/2 + z^2/12) / (1 - z/2 + z^2/12) in place of exp(z).
        """
        plan, given, x = self._plans[0], self._given[0], self._paths[0]
        numbers, half = jnp.asarray(self._split(row)[0]), len(x) // 2
        slopes = rate_slopes(plan, given, numbers, jnp.asarray(x[half]), half)
        z = np.linalg.eigvals(np.asarray(slopes)) * plan.dt
        wrong = np.abs((1.0 + z / 2.0 + z**2 / 12.0) / (1.0 - z / 2.0 + z**2 / 12.0) - np.exp(z))
        wrong /= np.maximum(1.0, np.abs(np.exp(z)))
        worst = int(np.argmax(wrong))
        return complex(z[worst] / plan.dt), float(wrong[worst])

    @property
    def covariance(self) -> Array:
        """Of the one-step errors at the row last accepted (o, o)."""
        errors = np.concatenate([seen.error for seen in self._filtered(self._accepted)])
        return np.asarray(errors.T @ errors / len(errors))

    def comparisons(self, row: Array) -> tuple[Comparison, ...]:
        """Every record beside what is predicted of each sample from those before."""
        return tuple(
            Comparison(
                record=record,
                counted=np.ones(record.time.size),
                model=record.outputs - seen.error,
                sigma=np.sqrt(np.median(seen.spread, axis=0)),
                states=np.zeros((record.time.size, 0)),
            )
            for record, seen in zip(self.records, self._filtered(row), strict=True)
        )
