"""Guided reduction of a model's structure: what the responses do not tell is taken out, one parameter at a time."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from swashplate.arrays import Complex
from swashplate.errors import IdentificationError
from swashplate.flights.flight import Flight
from swashplate.identification.core.result import Estimate
from swashplate.identification.frequency.mode_accuracy import ModeAccuracy
from swashplate.identification.frequency.state_space_fit import fit_targets
from swashplate.identification.frequency.state_space_result import CR_TARGET, I_TARGET, ReductionStep, StateSpaceFit
from swashplate.models.linear.state_space import StateSpaceModel
from swashplate.validation.refutation import REFUTED
from swashplate.validation.verification import Verification
from swashplate.validation.verify import verify

GROWTH, LEAST_GROWTH = 0.05, 0.5
"""J_ave may grow by this share, or by this much, in the whole reduction."""

MOVED = 3.0
"""Standard deviations by which a mode inside the band may move."""

FAR = 0.3
"""Share of its frequency by which a mode may move, however little its bounds tell (or one bound, if that is more)."""

_HARDLY = 0.01
"""Share of its frequency up to which a move of a mode is not worth a word."""

HOPELESS = 100.0
"""Standard deviation in percent above which a parameter that cannot be dropped is held at its start, if that does."""


def reduce(
    fit: StateSpaceFit,
    *,
    hold_out: Sequence[Flight] = (),
    progress: Callable[[int, float], None] | None = None,
) -> StateSpaceFit:
    """The fit with what the responses do not tell taken out (Tischler and Remple 2012, ch. 13).

    The most insensitive parameter above 10 % first, then the one with the largest standard deviation above 20 %; refit;
    a drop stands if J_ave has hardly grown since the start, no mode inside the band has gone or moved beyond its
    bounds, and the hold-out is followed as well as before; otherwise the parameter is put back and not tried again.

    A dropped parameter takes the value `dropped` of the model file (zero where nothing is said). One that cannot be
    dropped, but whose bound is above 100 %, stands for a product that alone is seen: it is held at its start value.
    """
    began = time.perf_counter()
    band = fit.settings.get("band_hz")
    limits = (float(band[0]), float(band[1])) if band else None

    def along(model: StateSpaceModel) -> Verification | None:
        return verify(model, hold_out, band=limits) if hold_out else None

    allowed = fit.cost + max(LEAST_GROWTH, GROWTH * fit.cost)
    full = along(fit.solution)
    history: list[ReductionStep] = list(fit.details.reduction)
    tried: set[str] = set()
    present = fit
    while True:
        choice = _candidate(present, tried)
        if choice is None:
            break
        name, reason = choice
        tried.add(name)
        p = present.solution.parameters[name]
        # A time constant of zero, say, is no structure with one parameter less.
        ways = [("", p.dropped)] if p.lower <= p.dropped <= p.upper else []
        if present[name].sigma_percent > HOPELESS:
            ways.append((", held at its start", fit[name].start))
        for remark, value in ways:
            new = _without(present, name, value)
            after = float("inf") if new is None else new.cost
            modes, gone = ("", False) if new is None else moved_modes(fit.details.modes, new.solution.eigenvalues())
            veto = "a mode has gone or moved beyond its bounds" if gone else ""
            if new is not None and after <= allowed and not veto and full is not None:
                veto = _worse(full, along(new.solution))
            kept = new is not None and after <= allowed and not veto
            history.append(ReductionStep(name, reason + remark, present.cost, after, kept, veto, modes))
            if progress is not None:
                progress(len(history), after)
            if new is not None and kept:
                present = new
                break
    estimates = tuple(replace(p, start=fit[p.name].start) for p in present.estimates)
    total, _ = moved_modes(fit.details.modes, present.solution.eigenvalues())
    return replace(
        present,
        start=fit.start,
        estimates=estimates,
        details=replace(present.details, reduction=tuple(history), reduced=True, reduced_modes=total),
        settings={**present.settings, "reduced": True},
        problems=fit.problems,
        warnings=(*present.warnings, *(() if hold_out else (_NO_HOLD_OUT,))),
        seconds=fit.seconds + time.perf_counter() - began,
    )


_NO_HOLD_OUT = "reduced without a hold-out: nothing but the fitted responses and modes guards what was taken out."


def moved_modes(modes: Sequence[ModeAccuracy], eigenvalues: Complex) -> tuple[str, bool]:
    """Where the told modes inside the band have gone, in words; whether one is lost or moved beyond its bounds."""
    left = [v for v in map(complex, eigenvalues) if v.imag >= -1e-12]
    lines, lost, same = [], False, 0
    for mode in modes:
        bound = float(np.hypot(mode.frequency_bound, mode.frequency * mode.damping_bound))
        if not mode.inside or not np.isfinite(bound):
            continue
        if not left:
            return f"{mode.frequency:.3g} rad/s has gone", True
        near = min(left, key=lambda v: abs(v - mode.eigenvalue))
        left.remove(near)
        shift = abs(near - mode.eigenvalue)
        far = shift > min(MOVED * bound, max(FAR * mode.frequency, bound))
        lost = lost or far
        if far or shift > _HARDLY * mode.frequency:
            lines.append(f"{_written(mode.eigenvalue)} to {_written(near)}{' (beyond its bounds)' if far else ''}")
        else:
            same += 1
    rest = f"{same} within {100.0 * _HARDLY:g} %" if same else ""
    return "modes: " + ", ".join([*lines, rest] if rest else lines) if lines or rest else "", lost


def _written(value: complex) -> str:
    """A mode as a person writes it: the real part alone where it is real."""
    return f"{value.real:.3g}" if value.imag == 0.0 else f"{value.real:.3g}{value.imag:+.3g}j"


def _worse(before: Verification, after: Verification | None) -> str:
    """Why a hold-out speaks against a drop; empty where it does not."""
    assert after is not None
    if after.verdict == REFUTED and before.verdict != REFUTED:
        return "the hold-out refutes it"
    if after.cost > (1.0 + GROWTH) * before.cost:
        return f"the hold-out's J_rms grows from {before.cost:.3g} to {after.cost:.3g}"
    return ""


def _without(fit: StateSpaceFit, name: str, value: float) -> StateSpaceFit | None:
    """The fit again with one parameter held at a value; None where nothing answers then."""
    model = fit.solution.with_values({name: value}, free=False)
    if not model.free:
        return None
    try:
        return fit_targets(
            model,
            fit.targets,
            ceilings=fit.details.ceilings,
            left_out=fit.details.left_out,
            starts=1,
            data=fit.data,
            settings=fit.settings,
        )
    except (IdentificationError, np.linalg.LinAlgError):
        return None


def _candidate(fit: StateSpaceFit, tried: set[str]) -> tuple[str, str] | None:
    moving = [p for p in fit.estimates if not p.fixed and not p.tie and p.name not in tried]

    def insensitivity(p: Estimate) -> float:
        return p.insensitivity_percent

    blind = [p for p in moving if p.insensitivity_percent > I_TARGET]
    if blind:
        worst = max(blind, key=insensitivity)
        return worst.name, f"insensitivity {worst.insensitivity_percent:.0f} %"
    vague = [p for p in moving if p.sigma_percent > CR_TARGET]
    if vague:
        worst = max(vague, key=lambda p: p.sigma_percent)
        return worst.name, f"standard deviation {worst.sigma_percent:.0f} %"
    return None
