"""Starting points of transfer-function fits: least squares on the polynomials, and roots spread over the band."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from swashplate.arrays import Array, Complex
from swashplate.identification.frequency.response_cost import Target
from swashplate.models.linear.transfer_function import Form, TransferFunction

SPREAD = 6
"""Starting points with roots at random places of the band."""

_DELAYS = (0.0, 0.02, 0.05, 0.1, 0.2)
_ROUNDS = 6


def starts(
    targets: Sequence[Target], form: Form, owner: Sequence[Mapping[str, str]], *, seed: int, longest_delay: float
) -> list[dict[str, float]]:
    """First guesses of every parameter.

    Args:
        targets: responses of one input, with shared poles.
        form: what each is made of.
        owner: per target, the form's own names ("K", zeros, "tau") and what they are called in the fit.
        seed: of the spread roots.
        longest_delay: [s].
    """
    guesses = []
    if form.poles or form.zeros:
        for delay in _DELAYS if form.delay else (0.0,):
            guess = _by_polynomials(targets, form, delay)
            if guess is not None:
                guesses.append(_with_gains(targets, form, owner, guess, longest_delay))
    random = np.random.default_rng(seed)
    low, high = min(t.omega[0] for t in targets), max(t.omega[-1] for t in targets)
    for k in range(SPREAD if form.pole_names or form.zero_names else 1):
        values: dict[str, float] = {}
        for name in (*form.pole_names, *form.zero_names):
            at = np.exp(random.uniform(np.log(low), np.log(high)))
            values[name] = float(random.uniform(0.1, 1.0) if name.startswith("zeta") else at)
            if name.startswith("zero") and k % 3 == 2:
                values[name] = -values[name]
        shared = {name: values[name] for name in form.pole_names}
        zeros = {name: values[name] for name in form.zero_names}
        guesses.append(_with_gains(targets, form, owner, (shared, [zeros] * len(targets)), longest_delay))
    return guesses


def _by_polynomials(
    targets: Sequence[Target], form: Form, delay: float
) -> tuple[dict[str, float], list[dict[str, float]]] | None:
    """N(s) - H D(s) = 0 by linear least squares, weighted anew with D (Levy 1959; Sanathanan, Koerner 1963)."""
    scale = float(np.exp(np.mean([np.log(t.omega).mean() for t in targets])))
    poles, zeros, count = form.poles, form.zeros, len(targets)
    bottoms = [np.ones(t.omega.size) for t in targets]
    solved = np.zeros(poles + count * (zeros + 1))
    for _ in range(_ROUNDS):
        rows, right = [], []
        for k, t in enumerate(targets):
            s = 1j * t.omega / scale
            h = t.measured * np.exp(1j * t.omega * delay) * s**form.integrators
            weight = np.sqrt(t.coherence) / np.abs(h) / bottoms[k]
            block = np.zeros((t.omega.size, solved.size), dtype=np.complex128)
            block[:, :poles] = -h[:, None] * s[:, None] ** np.arange(poles)
            first = poles + k * (zeros + 1)
            block[:, first : first + zeros + 1] = s[:, None] ** np.arange(zeros + 1)
            rows.append(block * weight[:, None])
            right.append(h * s**poles * weight)
        a, b = np.concatenate(rows), np.concatenate(right)
        solved = np.linalg.lstsq(np.concatenate([a.real, a.imag]), np.concatenate([b.real, b.imag]), rcond=None)[0]
        bottom = np.concatenate([solved[:poles], [1.0]])[::-1]
        bottoms = [np.maximum(np.abs(np.polyval(bottom, 1j * t.omega / scale)), 1e-9) for t in targets]
    shared = _factored(_roots(bottom) * scale, form.pole_names)
    tops = [solved[poles + k * (zeros + 1) :][: zeros + 1][::-1] for k in range(count)]
    if any(abs(top[0]) < 1e-12 * np.abs(top).max() for top in tops):
        return None
    return shared, [_factored(_roots(top) * scale, form.zero_names) for top in tops]


def _roots(polynomial: Array) -> Complex:
    return np.asarray(np.roots(polynomial), dtype=np.complex128)


def _factored(roots: Complex, names: Sequence[str]) -> dict[str, float]:
    """Roots as the factors that the names ask for: pairs by damping and frequency, at most one real root."""
    left = sorted(map(complex, roots), key=lambda r: (abs(r.imag) < 1e-9 * abs(r), abs(r)))
    pairs = [r for r in left if r.imag > 1e-9 * abs(r)]
    real = sorted((r.real for r in left if abs(r.imag) <= 1e-9 * abs(r)), key=abs)
    values: dict[str, float] = {}
    for name in names:
        if name.startswith("zeta_"):
            if pairs:
                one = pairs.pop(0)
                product, total = abs(one) ** 2, -2.0 * one.real
            else:
                first, second = real.pop(0), real.pop(0)
                # Real roots of opposite sign are no such pair: the nearest that is one.
                product, total = abs(first * second), -(first + second)
            omega = max(float(np.sqrt(product)), 1e-6)
            values[name], values["omega_" + name[5:]] = float(np.clip(total / 2.0 / omega, -1.9, 9.0)), omega
        elif not name.startswith("omega_"):
            values[name] = -float(real.pop(0)) if real else 1.0
    return values


def _with_gains(
    targets: Sequence[Target],
    form: Form,
    owner: Sequence[Mapping[str, str]],
    guess: tuple[dict[str, float], list[dict[str, float]]],
    longest_delay: float,
) -> dict[str, float]:
    """Gain (with its sign) and delay by what the roots leave of each response."""
    shared, each = guess
    values = dict(shared)
    for t, of_pair, zeros in zip(targets, owner, each, strict=True):
        shape = TransferFunction(form, {**shared, **zeros, "K": 1.0, "tau": 0.0})
        left = t.measured / shape.response(t.omega)
        tau = _delay(t.omega, left, longest_delay) if form.delay else 0.0
        turned = left * np.exp(1j * tau * t.omega)
        sign = float(np.sign(np.sum(turned.real / np.abs(turned)))) or 1.0
        values[of_pair["K"]] = sign * float(np.exp(np.mean(np.log(np.abs(left)))))
        values |= {of_pair[name]: value for name, value in zeros.items()}
        if form.delay:
            values[of_pair["tau"]] = tau
    return values


def _delay(omega: Array, left: Complex, longest: float) -> float:
    slope = float(np.polyfit(omega, np.unwrap(np.angle(left)), 1)[0])
    return float(np.clip(-slope, 0.0, 0.8 * longest))
