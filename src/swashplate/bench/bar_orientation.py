"""Directions of the stabilizer bar without a time base: how far it leans, and nothing about how fast.

    angle_i = angle(n_i, mean of n),   n: unit normals of the bar's plane, by motion capture

Any order of the samples gives the same angles, and samples at an unknown rate fit any time constant: tau_f,up of
Fankhauser et al., eq. 8 needs time stamps (`bar_motion`). What spoils it: markers that are swapped or lost for a
moment, which look like a lean.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from swashplate.arrays import Array
from swashplate.bench.record import BenchRecord
from swashplate.bench.result import BenchCheck, BenchFinding, BenchResult, Curve

NAME = "bar_orientation"
TITLE = "Stabilizer bar: directions without a time base"
SOURCE = "mean direction and angles to it; what it cannot tell: Fankhauser et al., eq. 8"
COLUMNS = ("normal_x", "normal_y", "normal_z")


def cone_of(normals: Array) -> Array:
    """Angles [rad] of unit vectors to their mean direction, shape (n,).

    Args:
        normals: unit vectors, shape (n, 3).
    """
    mean = normals.mean(axis=0)
    mean = mean / np.linalg.norm(mean)
    return np.asarray(np.arctan2(np.linalg.norm(np.cross(normals, mean), axis=1), normals @ mean))


def estimate(records: Sequence[BenchRecord], card: Mapping[str, float]) -> BenchResult:
    """How far the bar leans from its mean plane, as findings; no parameter.

    A bound is given for the mean only where samples could be told to be independent, which needs a time base: none.
    """
    findings, checks, curves = [], [], []
    for record in records:
        angles = cone_of(np.column_stack([record[name] for name in COLUMNS]))
        spread = np.sort(np.degrees(angles))
        for name, value in (("root mean square", np.sqrt(np.mean(angles**2))), ("largest", angles.max())):
            findings.append(
                BenchFinding(f"{name} lean of the bar from its mean plane", float(value), float("nan"), "rad")
            )
        checks.append(
            BenchCheck(
                f"{record.name}: {angles.size} directions without a time base. A time constant cannot be had from "
                "them, nor a bound of the lean: how many of them are independent is not known. Record time stamps and "
                "the fuselage beside the bar (bar_motion)."
            )
        )
        share = np.arange(1.0, spread.size + 1) / spread.size
        curves.append(
            Curve("Directions of the bar", "lean from the mean plane [deg]", "share of the samples below",
                  spread, share, spread[:0], share[:0])
        )  # fmt: skip
    return BenchResult.of_findings(NAME, TITLE, SOURCE, records, checks, curves, findings)
