"""The observer's matrix operations for many vehicles at once, the vehicle last: scalar equations run over them.

Measured on two cores for 36 estimates: under `vmap` the vehicles come first wherever a matrix is multiplied, every
scalar taken from a column then strides over memory, and one evaluation of the equations takes ten times as long.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from swashplate.filtering import stack_kernels
from swashplate.filtering.matrix_operations import JaxMatrices, Scalars
from swashplate.jax_on_demand import jax, jnp, when_loaded
from swashplate.physics.backend import Backend
from swashplate.simulation.trigonometry import vector_backend


@dataclass(frozen=True)
class Stack:
    """Matrices of many vehicles, shape (rows, columns, vehicles); operators are those of one matrix.

    The other operand may be a stack, a matrix that is the same for all, or a number.
    """

    data: Any
    __array_ufunc__: ClassVar[None] = None  # an array on the left leaves the operation to the stack

    @property
    def shape(self) -> tuple[int, int]:
        """Of one matrix."""
        return self.data.shape[:2]

    @property
    def T(self) -> Stack:
        return Stack(jnp.swapaxes(self.data, 0, 1))

    def __getitem__(self, place: tuple[slice, slice]) -> Stack:
        return Stack(self.data[place])

    def __matmul__(self, other: Stack) -> Stack:
        if self.shape[1] == 1:
            return Stack(self.data * other.data)
        return Stack(jnp.einsum("ikb,kjb->ijb", self.data, other.data))

    def __rmatmul__(self, other: Any) -> Stack:
        return Stack(jnp.einsum("ik,kjb->ijb", other, self.data))

    def __add__(self, other: Any) -> Stack:
        return Stack(self.data + _of(other))

    def __sub__(self, other: Any) -> Stack:
        return Stack(self.data - _of(other))

    def __mul__(self, other: Any) -> Stack:
        return Stack(self.data * _of(other))

    __radd__ = __add__
    __rmul__ = __mul__


when_loaded(lambda: jax.tree_util.register_dataclass(Stack))


def _of(other: Any) -> Any:
    if isinstance(other, Stack):
        return other.data
    return other[:, :, None] if jnp.ndim(other) == 2 else other


class StackMatrices(JaxMatrices):
    """The operations on stacks; a scalar is a row with a number per vehicle, a row of them has shape (n, vehicles).

    Args:
        vehicles: how many.
    """

    def __init__(self, vehicles: int) -> None:
        self.xp: Backend = vector_backend()
        self._vehicles = vehicles

    def column(self, scalars: Sequence[Any], /) -> Stack:
        return Stack(self.row(scalars)[:, None])

    def scalars(self, column: Stack, /) -> list[Any]:
        return [column.data[i, 0] for i in range(column.shape[0])]

    def linearised(self, f: Scalars, x: Stack, w: Stack, /) -> tuple[Stack, Stack]:
        """Value (m, 1) and Jacobian by x (m, n)."""
        rest, n = self.scalars(w), x.shape[0]
        value, slopes = jax.linearize(lambda rows: self.row(f([rows[i] for i in range(n)], rest)), x.data[:, 0])
        basis = jnp.broadcast_to(jnp.eye(n)[:, :, None], (n, n, self._vehicles))
        return Stack(value[:, None]), Stack(jax.vmap(slopes, out_axes=1)(basis))

    def row(self, scalars: Sequence[Any], /) -> Any:
        return jnp.stack([jnp.broadcast_to(jnp.asarray(s, dtype=float), (self._vehicles,)) for s in scalars])

    def matrix(self, row: Any, rows: int, columns: int, /) -> Stack:
        return Stack(row.reshape(rows, columns, self._vehicles))

    def flat(self, matrix: Stack, /) -> Any:
        return matrix.data.reshape(-1, self._vehicles)

    def propagated(self, A: Stack, J: Stack | None, P: Stack, noise: Any, dt: float) -> Stack | None:
        """The covariance a sample later by one call of C (`stack_kernels.propagated`); None where there is no C."""
        if not stack_kernels.fits(P.shape[0]):
            return None
        rows = jnp.zeros((0, *P.data.shape[1:])) if J is None else J.data
        return Stack(stack_kernels.propagated(A.data, rows, P.data, jnp.asarray(noise), dt))

    def updated(
        self, H: Stack, mean: Stack, P: Stack, innovations: Stack, noise: Any
    ) -> tuple[Stack, Stack, Stack] | None:
        """Mean, covariance and that of the innovations after readings by one call of C; None where there is no C."""
        if not stack_kernels.fits(P.shape[0]):
            return None
        arrays = stack_kernels.updated(H.data, P.data, mean.data[:, 0], innovations.data[:, 0], jnp.asarray(noise))
        return Stack(arrays[0][:, None]), Stack(arrays[1]), Stack(arrays[2])

    def stacked(self, parts: Sequence[Stack], /) -> Stack:
        return Stack(jnp.concatenate([part.data for part in parts], axis=0))
