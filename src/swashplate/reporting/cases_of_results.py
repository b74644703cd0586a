"""Parameters of several fits side by side, with their bounds and their distance in standard deviations."""

from __future__ import annotations

import math
from collections.abc import Mapping
from itertools import combinations
from typing import Any

import numpy as np

from swashplate.identification.core.result import APART, Estimate, Result
from swashplate.reporting.case_parts import CaseParts
from swashplate.reporting.structure import Cell, tabulate


def compare_estimates(cases: Mapping[str, Result[Any, Any]]) -> CaseParts:
    """Values and standard deviations by parameter; differences from the first in standard deviations of the difference.

    The sigma of a difference is that of independent fits, sqrt(s1^2 + s2^2); fits to the same data are not, and that
    is said. The corrected bound is taken where a fit has one.
    """
    names = list(cases)
    parameters = list(dict.fromkeys(e.name for result in cases.values() for e in result.estimates))
    rows, document, remarks = [], {}, []
    for parameter in parameters:
        by_case = {n: next((e for e in r.estimates if e.name == parameter), None) for n, r in cases.items()}
        first = by_case[names[0]]
        unit = next(e.unit for e in by_case.values() if e is not None)
        entry: dict[str, Any] = {"unit": unit}
        cells = [parameter, unit]
        for name, e in by_case.items():
            cells += _of(e)
            sigma = float("nan") if e is None or not e.free else e.best_sigma
            entry[name] = None if e is None else {"value": e.value, "sigma": _finite(sigma)}
            if name == names[0]:
                continue
            away = distance(first, e)
            far = abs(away) > APART
            difference = "" if np.isnan(away) else f"{away:+.1f}"
            cells.append(Cell(difference, number=True, tone="caution" if far else "plain"))
            if e is not None:
                entry[name]["away"] = _finite(away)
            if far:
                remarks.append(f"{parameter}: {name} differs from {names[0]} by {abs(away):.1f} standard deviations.")
        rows.append((*cells,))
        document[parameter] = entry
    units = {p: {e.unit for r in cases.values() for e in r.estimates if e.name == p} for p in parameters}
    remarks += [f"{p} has different units: {', '.join(sorted(u))}." for p, u in units.items() if len(u) > 1]
    remarks += _shared_data(cases)
    head = ["parameter", "unit"]
    for name in names:
        head += [name, "CR [%]"] + (["sigmas away"] if name != names[0] else [])
    note = f"Sigmas away: difference from {names[0]} over that of independent fits; beyond {APART:g} they disagree."
    table = tabulate("Parameters", head, rows, note=note)
    return CaseParts((table,), told=tuple(remarks), document={"parameters": document})


def distance(first: Estimate | None, other: Estimate | None) -> float:
    """Difference in standard deviations; NaN where one is not there, has another unit, or both know no deviation."""
    if first is None or other is None or first.unit != other.unit:
        return float("nan")
    spread = math.hypot(*(e.best_sigma if e.free and np.isfinite(e.best_sigma) else 0.0 for e in (first, other)))
    return (other.value - first.value) / spread if spread > 0.0 else float("nan")


def _of(e: Estimate | None) -> list[Cell | str]:
    if e is None:
        return ["-", ""]
    known = e.free and np.isfinite(e.best_sigma) and e.value
    sigma = f"{100.0 * e.best_sigma / abs(e.value):.1f}" if known else "fixed" if e.fixed else ""
    percent = f"= {e.tie}" if e.tie else sigma
    return [f"{e.value:.5g}", percent]


def _finite(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


def _shared_data(cases: Mapping[str, Result[Any, Any]]) -> list[str]:
    """Fits that have seen the same data: their differences are less certain to be chance than the sigmas say."""
    logs = {n: {s.signals or f"{s.sha256} {s.name}": s.name for s in r.data} for n, r in cases.items()}
    pairs = [(a, b, sorted({logs[a][k] for k in logs[a].keys() & logs[b].keys()})) for a, b in combinations(cases, 2)]
    return [
        f"{a} and {b} have seen the same data ({', '.join(both)}): their differences are more significant than the "
        "sigmas of independent fits say."
        for a, b, both in pairs
        if both
    ]
