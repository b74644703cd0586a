"""A table of stability and control derivatives, split by what contributes to them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np

from swashplate.arrays import Array
from swashplate.errors import SwashError

ROWS = ("X", "Y", "Z", "L", "M", "N")
MOTIONS = ("u", "v", "w", "p", "q", "r")
CONTROLS = ("theta0", "B1", "A1", "theta0T")
COLUMNS = (*MOTIONS, *CONTROLS)
_FOOT = 0.3048


@dataclass(frozen=True)
class DerivativeTable:
    """Derivatives of force per mass and moment per inertia: X_u = (dX/du)/m, L_v = (dL/dv)/I_xx, M_B1 = ...

    Flapping follows the motion without delay (6 degrees of freedom), as in Bhandari et al. (2005), eqs 13 and 14.

    Attributes:
        parts: by contributor, shape (6, 10): rows X Y Z L M N, columns u v w p q r theta0 B1 A1 theta0T; SI.
        flapping: change of a1 and b1 by column, shape (2, 10).
        source: "build-up" or "automatic differentiation".
    """

    parts: Mapping[str, Array]
    flapping: Array
    source: str

    @property
    def total(self) -> Array:
        """The sum over the contributors, shape (6, 10)."""
        return np.asarray(np.sum(list(self.parts.values()), axis=0))

    def __getitem__(self, name: str) -> float:
        """One derivative by its name, e.g. "Xu", "Mq", "Ltheta0T"."""
        row, column = split_name(name)
        return float(self.total[row, column])

    def primed(self, *, inertia_xx: float, inertia_zz: float, inertia_xz: float) -> DerivativeTable:
        """The table with roll and yaw rows as angular accelerations: L' and N', which the product of inertia mixes.

        L' = (L + (I_xz / I_xx) N) / (1 - I_xz^2 / (I_xx I_zz)) with L and N per own inertia, N' likewise
        (McRuer, Ashkenas and Graham 1973). Most
        published tables, the Lynx's among them, are of this kind.
        """
        mixing = np.eye(6)
        determinant = 1.0 - inertia_xz**2 / (inertia_xx * inertia_zz)
        mixing[3, 3] = mixing[5, 5] = 1.0 / determinant
        mixing[3, 5], mixing[5, 3] = inertia_xz / inertia_xx / determinant, inertia_xz / inertia_zz / determinant
        return replace(self, parts={name: mixing @ part for name, part in self.parts.items()})

    def names(self) -> Iterator[str]:
        """All names, row by row."""
        return (row + column for row in ROWS for column in COLUMNS)

    def values(self) -> dict[str, float]:
        """All derivatives by name."""
        return dict(zip(self.names(), self.total.ravel().tolist(), strict=True))


def split_name(name: str) -> tuple[int, int]:
    """Row and column of a derivative's name.

    Raises:
        SwashError: where there is no such derivative.
    """
    row, column = name[:1], name[1:]
    if row not in ROWS or column not in COLUMNS:
        raise SwashError(
            "is no derivative.", channel=name, hint=f"Names are one of {', '.join(ROWS)} and of {', '.join(COLUMNS)}."
        )
    return ROWS.index(row), COLUMNS.index(column)


def unit(name: str, *, imperial: bool = False) -> str:
    """The unit of a derivative: SI, or the pounds and feet of Bhandari et al. (per slug and slug ft^2: feet remain)."""
    row, column = split_name(name)
    length = "ft" if imperial else "m"
    above = f"{length}/s^2" if row < 3 else "1/s^2"
    if column >= len(MOTIONS):
        return f"{above}/rad"
    if row < 3:
        return "1/s" if column < 3 else f"{length}/s"
    return f"1/({length} s)" if column < 3 else "1/s"


def factor_to_feet(row: int, column: int) -> float:
    """What an SI derivative is multiplied by for feet: lengths in the numerator and in a velocity's denominator."""
    factor = 1.0 / _FOOT if row < 3 else 1.0
    return factor * _FOOT if column < 3 else factor
