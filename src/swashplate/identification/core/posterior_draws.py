"""`Posterior`: draws of what a fit does not know, whether they may be believed, and a file that ArviZ reads."""

from __future__ import annotations

import io
import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from swashplate.arrays import Array
from swashplate.atomic import write_bytes
from swashplate.errors import IdentificationError
from swashplate.text_table import text_table

if TYPE_CHECKING:
    import xarray as xr


_TRIES = 100


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
        IdentificationError: where the distribution lies mostly outside the bounds.
    """
    random = np.random.default_rng(seed)
    scale = np.sqrt(np.diag(covariance))
    values, vectors = np.linalg.eigh(covariance / np.outer(scale, scale))
    root = scale[:, None] * vectors * np.sqrt(np.maximum(values, 0.0))
    drawn = np.empty((0, len(mean)))
    for _ in range(_TRIES):
        tried = mean + random.standard_normal((count, len(mean))) @ root.T
        drawn = np.concatenate([drawn, tried[np.all((tried >= low) & (tried <= high), axis=1)]])[:count]
        if len(drawn) == count:
            return drawn
    raise IdentificationError(
        f"only {len(drawn)} of {count * _TRIES} draws lie within the bounds of physics.",
        where=where,
        hint="The fit knows too little; fix parameters or add data.",
    )


SPLIT_RHAT = 1.01
"""At most, for draws that may be used (Vehtari et al. 2021)."""
LEAST_ESS = 400.0
"""Effective number of draws of every parameter at least (Vehtari et al. 2021: 100 a chain of four)."""
MOST_DIVERGENT = 0.01
"""Share of the draws at most whose trajectory ran away."""

QUANTILES = (0.025, 0.5, 0.975)


@dataclass(frozen=True, repr=False)
class Posterior:
    """Draws of a fit's row of numbers: the model's parameters first, then what belongs to records and noise.

    Attributes:
        method: "laplace" (normal about the optimum) or "nuts".
        names: of the numbers. parameters: how many of them are the model's.
        units: of the model's parameters.
        draws: shape (chains, draws, numbers), in units.
        rhat, ess: split-R-hat and effective number of draws of each number; empty for independent draws.
        stats: of the sampler, (chains, draws) each: lp, diverging, energy, tree_depth, n_steps, acceptance_rate.
        step: step size of each chain, in standard deviations of the metric.
        seed: of the draws.
    """

    method: str
    names: tuple[str, ...]
    parameters: int
    units: tuple[str, ...]
    draws: Array
    rhat: Array = field(default_factory=lambda: np.empty(0))
    ess: Array = field(default_factory=lambda: np.empty(0))
    stats: Mapping[str, Array] = field(default_factory=dict)
    step: Array = field(default_factory=lambda: np.empty(0))
    seed: int = 0

    @property
    def values(self) -> Array:
        """Draws of the model's parameters, all chains one after the other, shape (draws, parameters)."""
        return np.asarray(self.draws[:, :, : self.parameters].reshape(-1, self.parameters))

    @property
    def diverging(self) -> float:
        """Share of the draws whose trajectory ran away."""
        flags = self.stats.get("diverging")
        return 0.0 if flags is None else float(np.mean(flags))

    @property
    def faults(self) -> tuple[str, ...]:
        """Why the draws may not be believed, in words; empty where nothing speaks against them."""
        if not self.rhat.size:
            return ()
        faults = []
        # A number that never moves has no R-hat: that is a fault and no pass.
        mixed = ~(self.rhat < SPLIT_RHAT)
        if mixed.any():
            worst = np.argsort(-np.nan_to_num(self.rhat, nan=np.inf))[: min(3, int(mixed.sum()))]
            named = ", ".join(f"{self.names[i]} {self.rhat[i]:.3f}" for i in worst)
            faults.append(f"split-R-hat is to be below {SPLIT_RHAT:g}, found {named} ({mixed.sum()} numbers above)")
        few = ~(self.ess[: self.parameters] >= LEAST_ESS)
        if few.any():
            worst = np.argsort(np.nan_to_num(self.ess[: self.parameters]))[: min(3, int(few.sum()))]
            named = ", ".join(f"{self.names[i]} {self.ess[i]:.0f}" for i in worst)
            faults.append(f"{LEAST_ESS:g} effective draws are needed, found {named} ({few.sum()} parameters below)")
        if self.diverging > MOST_DIVERGENT:
            faults.append(
                f"{100.0 * self.diverging:.1f} % of the trajectories ran away, at most {100 * MOST_DIVERGENT:g} %"
            )
        return tuple(faults)

    def check(self, *, where: str) -> None:
        """That the draws may be used.

        Raises:
            IdentificationError: with what speaks against them.
        """
        if self.faults:
            raise IdentificationError(
                f"the posterior did not converge: {'; '.join(self.faults)}.",
                where=where,
                channel="posterior",
                hint="Allow more draws, or fix parameters and add data where the fit says that it sees little; "
                "'laplace' stays usable.",
            )

    def drawn(
        self, low: Array, high: Array, *, count: int, seed: int, covariances: tuple[Array, Array] | None, where: str
    ) -> Array:
        """Some of the draws of the model's parameters, each once as long as there are enough, (count, parameters).

        Args:
            low, high: bounds of physics (parameters,); draws beyond them are left out.
            count: how many. seed: of the choice.
            covariances: at the optimum, plain and corrected for coloured residuals, which spreads the draws
                (`adjusted`); None, or a corrected one that is not finite, takes them as they are.
            where: whose posterior it is.

        Raises:
            IdentificationError: where they did not converge, or most of them lie beyond the bounds.
        """
        where = f"the posterior of {where}"
        self.check(where=where)
        values = self.values
        if covariances is not None and np.all(np.isfinite(covariances[1])):
            values = adjusted(values, *covariances)
        kept = values[np.all((values >= low) & (values <= high), axis=1)]
        if 2 * len(kept) < len(values):
            raise IdentificationError(
                f"only {len(kept)} of {len(values)} draws lie within the bounds of physics.",
                where=where,
                hint="The fit knows too little; fix parameters or add data.",
            )
        return np.asarray(kept[np.random.default_rng(seed).choice(len(kept), count, replace=count > len(kept))])

    def tree(self) -> xr.DataTree:
        """The draws as ArviZ lays them out: groups `posterior`, `sample_stats` and, for NUTS, `diagnostics`."""
        import xarray as xr

        chains, count = self.draws.shape[:2]
        dims, k = ("chain", "draw"), self.parameters
        coords = {"chain": np.arange(chains), "draw": np.arange(count)}
        attributes = {"inference_library": "swashplate", "seed": self.seed}
        variables: dict[str, Any] = {
            name: (dims, self.draws[:, :, i], {"units": unit})
            for i, (name, unit) in enumerate(zip(self.names[:k], self.units, strict=True))
        }
        rest = list(self.names[k:])
        if rest:
            variables["constants"] = ((*dims, "constant"), self.draws[:, :, k:])
        more = {"constant": rest} if rest else {}
        groups = {"posterior": xr.Dataset(variables, coords | more, attributes)}
        if self.stats:
            stats: dict[str, Any] = {name: (dims, values) for name, values in self.stats.items()}
            stats["diverging"] = (dims, self.stats["diverging"] > 0.5)
            stats |= {"step_size": ("chain", self.step)}
            groups["sample_stats"] = xr.Dataset(stats, coords, attributes)
        if self.rhat.size:
            numbers = {"rhat": ("number", self.rhat), "ess": ("number", self.ess)}
            groups["diagnostics"] = xr.Dataset(numbers, {"number": list(self.names)})
        tree = xr.DataTree.from_dict({f"/{name}": group for name, group in groups.items()})
        tree.attrs["creation_library"] = "swashplate"
        tree.attrs["method"] = self.method
        return tree

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Write the draws as netCDF (`xarray.open_datatree`, `arviz.from_netcdf`).

        Raises:
            WriteError: for a place that cannot be written to.
        """
        import xarray as xr

        file, tree = io.BytesIO(), self.tree()
        xr.Dataset(attrs=tree.attrs).to_netcdf(file, mode="w", engine="h5netcdf")
        for name, group in tree.children.items():
            group.to_dataset().to_netcdf(file, mode="a", group=name, engine="h5netcdf")
        return write_bytes(Path(path), file.getbuffer())

    def rows(self) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
        """Heading and cells of a table of the model's parameters: quantiles, spread, and how well they were drawn."""
        quantiles = np.quantile(self.values, QUANTILES, axis=0)
        spread = self.values.std(axis=0, ddof=1)
        rows: list[tuple[str, ...]] = []
        for i, name in enumerate(self.names[: self.parameters]):
            cells = [name, *(f"{q:.5g}" for q in quantiles[:, i]), f"{spread[i]:.2g}"]
            cells += [f"{self.rhat[i]:.4f}", f"{self.ess[i]:.0f}"] if self.rhat.size else ["", ""]
            rows.append((*cells, self.units[i]))
        return ("parameter", "2.5 %", "median", "97.5 %", "sd", "split-R-hat", "ESS", "unit"), rows

    def __repr__(self) -> str:
        chains, count = self.draws.shape[:2]
        title = f"posterior by {self.method}: {chains} chains of {count} draws"
        if self.stats:
            title += f", {100.0 * self.diverging:.2g} % ran away"
        return "\n".join([title, text_table(*self.rows(), left=(0, 7)), *(f"! {fault}." for fault in self.faults)])


def adjusted(draws: Array, bound: Array, corrected: Array) -> Array:
    """Draws of a likelihood that takes coloured residuals for white, spread as the corrected covariance says.

    The linear map about their mean that takes a normal distribution of the plain covariance into one of the corrected,
    the one of least way (Olkin and Pukelsheim 1982); what the draws have of skewness stays. Curvature adjustment:
    Ribatet, Cooley and Davison (2012).

    Args:
        draws: shape (n, p).
        bound, corrected: covariances at the optimum (p, p), the first as the likelihood has it.
    """
    scale = np.sqrt(np.diag(bound))
    P, C = bound / np.outer(scale, scale), corrected / np.outer(scale, scale)
    root = _root(P)
    inverse = np.linalg.pinv(root, hermitian=True)
    way = inverse @ _root(root @ C @ root) @ inverse
    mean = draws.mean(axis=0)
    return np.asarray(mean + ((draws - mean) / scale) @ way.T * scale)


def _root(matrix: Array) -> Array:
    values, vectors = np.linalg.eigh(0.5 * (matrix + matrix.T))
    return np.asarray((vectors * np.sqrt(np.maximum(values, 0.0))) @ vectors.T)
