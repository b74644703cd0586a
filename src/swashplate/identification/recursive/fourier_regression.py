"""Recursive Fourier regression: an equation of motion, estimated while its signals arrive.

Transforms at fixed frequencies are sums that every sample adds to (Morelli 1999; 2000, "Real-time parameter estimation
in the frequency domain", J. Guidance 23(5)): memory and work do not grow with time. Complex least squares over the
frequencies gives the coefficients whenever they are wanted. The derivative of a state is j omega times its transform,
and what the state is at both ends of the stretch, so that nothing is differentiated or filtered.

Bounds are those of least squares with residuals that are not independent (Morelli and Klein 1997), written in
frequency: M^-1 cov(sum A* v) M^-1. The residual's spectrum is what the lines around have; between the lines k and l of
a short record it is correlated as the transform of the record's window at f_k - f_l and f_k + f_l says. That counts
colour, lines that lie closer than the record tells apart, forgetting and gaps alike. It does not count what strong
gusts do to the estimate itself: they move the regressors too, and equation error is then biased.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from swashplate.arrays import Array
from swashplate.errors import IdentificationError
from swashplate.identification.recursive.equation import RegressionEquation
from swashplate.identification.time.equation_error import EquationError

LEAST_PIVOT = 1e-8
"""Of the scaled normal equations: a regressor of which less than this is its own is not told apart."""
LEAST_FREEDOM = 4.0
"""Independent numbers behind the residual, below which it says nothing of its size."""
LEAST_LEFT = 0.1
"""Share of a line's residual that the coefficients leave at least, for what the bounds take."""
LATE = 1.5
"""Usual steps: a longer one is a gap."""
EARLY = 0.5
"""Usual steps: a shorter one is a clock that jumped."""
NO_NUMBER, GAP, CLOCK = "a value that is no number", "a gap", "a clock that jumped"
"""Why an estimate is frozen."""

Complex = NDArray[np.complex128]

BAND, _HIGHEST = (0.1, 2.5), 0.2
"""Usual lines from and to [Hz], and the share of the rate up to which lines can be used."""


@dataclass(frozen=True)
class RegressionPlan:
    """What a recursive regression works with: everything but the numbers that it gathers.

    Attributes:
        equation: what is estimated.
        dt: sample time [s].
        spacing: of the lines [Hz].
        first, last: the lines, in multiples of the spacing.
        memory: time constant after which a sample counts e times less [s]; infinite: nothing is forgotten.
        held: channels that stay what they are until the next sample, such as commands; the others are smooth.
        instruments: channels that gusts do not move (commands without feedback); empty for plain least squares.
    """

    equation: RegressionEquation
    dt: float
    spacing: float
    first: int
    last: int
    memory: float
    held: tuple[str, ...]
    instruments: tuple[str, ...] = ()

    @property
    def hertz(self) -> Array:
        """The lines [Hz]."""
        return self.spacing * np.arange(self.first, self.last + 1, dtype=np.float64)

    @property
    def keep(self) -> float:
        """What a sample still counts after the next one."""
        return float(np.exp(-self.dt / self.memory))

    @property
    def around(self) -> int:
        """Lines to each side whose residuals tell the spectrum at a line."""
        return max(2, (self.last - self.first + 1) // 6)

    @property
    def hold(self) -> Complex:
        """What the gathered sums of a channel that is held are multiplied with to be its transform, (lines,)."""
        omega = 2.0 * np.pi * self.hertz
        factor: Complex = (1.0 - np.exp(-1j * omega * self.dt)) / (1j * omega)
        return factor

    @property
    def factors(self) -> Complex:
        """The same for each channel, (channels, lines)."""
        omega = 2.0 * np.pi * self.hertz
        rows = []
        for name in self.equation.channels:
            delay = 0.0 if name == self.equation.left else self.equation.delays.get(name, 0.0)
            hold = self.hold if name in self.held else np.ones_like(omega)
            rows.append(hold * np.exp(-1j * omega * delay))
        return np.array(rows, dtype=np.complex128)


def regression_plan(
    equation: RegressionEquation,
    *,
    rate: float,
    band: tuple[float, float] | None = None,
    spacing: float | None = None,
    memory: float | None = None,
    held: Sequence[str] = (),
    instruments: Sequence[str] = (),
) -> RegressionPlan:
    """What a recursive regression works with.

    Args:
        equation: what is estimated.
        rate: samples per second [Hz].
        band: lines from and to [Hz]; what moves the vehicle should lie in it. None: `BAND`, as far as the rate allows.
        spacing: of the lines [Hz]; a 25th of the band's upper end where None.
        memory: time constant of forgetting [s]; None: nothing is forgotten.
        held: channels that are held between samples.
        instruments: channels that gusts do not move, for an estimate that strong gusts do not bias.

    Raises:
        IdentificationError: a band beyond a fifth of the rate, or too few lines; an unknown channel; no memory.
    """
    low, high = (BAND[0], min(BAND[1], _HIGHEST * rate)) if band is None else band
    wide = high / 25.0 if spacing is None else spacing
    if not (0.0 < low < high <= _HIGHEST * rate and 0.0 < wide < np.inf):
        raise IdentificationError(
            f"{low:g} to {high:g} Hz at {rate:g} samples a second: expected 0 < LOW < HIGH, "
            f"HIGH up to {_HIGHEST * rate:g}.",
            channel="band",
        )
    first, last = max(1, round(low / wide)), round(high / wide)
    if last - first + 1 < len(equation.names) + 2 or last > 1000:
        raise IdentificationError(
            f"{max(0, last - first + 1)} lines {wide:g} Hz apart for {len(equation.names)} unknowns; "
            f"expected {len(equation.names) + 2} to 1000.",
            channel="band",
            hint="Widen the band or narrow the spacing.",
        )
    if memory is not None and not 10.0 / rate <= memory < np.inf:
        raise IdentificationError(f"is {memory} s, expected {10.0 / rate:g} or more.", channel="memory")
    strange = [name for name in (*held, *instruments, *equation.delays) if name not in equation.channels]
    if strange:
        raise IdentificationError(f"does not stand in '{equation.text}'.", channel=strange[0])
    if equation.left in held and equation.derivative:
        raise IdentificationError("is differentiated: it cannot be held.", channel=equation.left)
    if equation.left in instruments:
        raise IdentificationError("is what is to be explained: no instrument.", channel=equation.left)
    return RegressionPlan(
        equation,
        1.0 / rate,
        wide,
        first,
        last,
        np.inf if memory is None else memory,
        tuple(held),
        tuple(dict.fromkeys(instruments)),
    )


@dataclass
class RecursiveRegression:
    """A regression along a stream. Feed it with `step`; ask `estimate` at any time.

    A sample that is not finite, a gap and a jump of the clock freeze it: what was gathered stays, and the next sample
    begins a new stretch whose ends count of themselves.

    Attributes:
        plan: what it works with.
        sums: transforms that are gathered: the channels (`equation.channels`), one, and the left side's ends.
        window: transform of the squared weights at every multiple of the spacing up to twice the last line.
        frozen: why the last sample did not count; "" where it did, and for the first one of all.
    """

    plan: RegressionPlan
    sums: Complex = field(init=False)
    window: Complex = field(init=False)
    frozen: str = field(init=False, default="")
    _turned: complex = field(init=False, default=1.0 + 0.0j)
    _last: Array | None = field(init=False, default=None)

    def __post_init__(self) -> None:
        lines = self.plan.last - self.plan.first + 1
        self.sums = np.zeros((len(self.plan.equation.channels) + 2, lines), dtype=np.complex128)
        self.window = np.zeros(2 * self.plan.last + 1, dtype=np.complex128)

    def step(self, elapsed: float, sample: Sequence[float] | Array) -> bool:
        """Take one sample in.

        Args:
            elapsed: seconds since the sample before; anything for the first one.
            sample: of `plan.equation.channels`, in that order.

        Returns:
            Whether it counts: False where the estimate is frozen, and for the first sample of a stretch.
        """
        now = np.asarray(sample, dtype=np.float64)
        plan = self.plan
        if not np.all(np.isfinite(now)):
            self._last, self.frozen = None, NO_NUMBER
            return False
        before, self._last = self._last, now
        if before is None:
            return False
        # `not ... <` is true for a time that is none
        if not EARLY * plan.dt < elapsed < LATE * plan.dt:
            self.frozen = GAP if elapsed >= LATE * plan.dt else CLOCK
            return False
        self.frozen = ""
        begin = self._turned
        end = begin * np.exp(-2j * np.pi * plan.spacing * plan.dt)
        end *= 1.5 - 0.5 * (end.real * end.real + end.imag * end.imag)  # back onto the circle (Newton's step)
        self._turned = end
        powers = np.arange(2 * plan.last + 1)
        both = begin**powers, end**powers
        half = 0.5 * plan.dt
        self.window = plan.keep**2 * self.window + half * (both[0] + both[1])
        then, here = (turns[plan.first : plan.last + 1] for turns in both)
        smooth = np.array([name not in plan.held for name in plan.equation.channels])[:, None]
        added = np.where(smooth, half * (before[:, None] * then + now[:, None] * here), np.outer(before, then))
        ends = now[0] * here - before[0] * then
        self.sums = plan.keep * self.sums + np.vstack([added, then, ends])
        return True

    def estimate(self) -> EquationError | None:
        """The coefficients as they are known now; None while the stream does not tell them apart."""
        left, right = self.rows()
        solved = _solved(left, right, self.window, self.plan, self._moved_by_instruments(right))
        if solved is None:
            return None
        values, covariance, residual = solved
        power, total = (float(np.vdot(part, part).real) for part in (residual, left))
        length = max(float(self.window[0].real), 1e-300)
        return EquationError(
            self.plan.equation.names,
            values,
            np.sqrt(np.diag(covariance)),
            1.0 - power / max(total, 1e-300),
            float(np.sqrt(power / len(left) / length)),
            covariance=covariance,
        )

    def _moved_by_instruments(self, right: Complex) -> Complex:
        """What the instruments have moved of the right side's columns: all of them where there are none.

        A column answers an instrument as a transfer function of low order does, and as nothing that gusts have done.
        """
        plan, e = self.plan, self.plan.equation
        if not plan.instruments:
            return right
        jw, corner = 2j * np.pi * plan.hertz, 2.0 * np.pi * np.sqrt(plan.hertz[0] * plan.hertz[-1])
        shapes = np.array([np.ones_like(jw), jw, 1.0 / jw, 1.0 / (jw + corner), 1.0 / (jw + corner) ** 2])
        places = [e.channels.index(name) for name in plan.instruments]
        columns = [shape * self.sums[k] * plan.factors[k] for k in places for shape in shapes]
        basis = np.column_stack([*columns, plan.hold * self.sums[-2]])
        size = np.linalg.norm(basis, axis=0)
        stacked = np.vstack([basis.real, basis.imag])[:, size > 0.0] / size[size > 0.0]
        parts = np.vstack([right.real, right.imag])
        projected = stacked @ np.linalg.lstsq(stacked, parts, rcond=None)[0]
        return np.asarray(projected[: len(right)] + 1j * projected[len(right) :])

    def rows(self) -> tuple[Complex, Complex]:
        """Left side (lines) and right side (lines, unknowns) of the complex equations."""
        plan, e = self.plan, self.plan.equation
        transforms = dict(zip(e.channels, self.sums[:-2] * plan.factors, strict=True))
        left = transforms[e.left]
        if e.derivative:
            # A weight that fades is constant within a step, so the derivative of each step is exact.
            left = self.sums[-1] + 2j * np.pi * plan.hertz * left
        for name, factor in e.known.items():
            left = left - factor * transforms[name]
        columns = [transforms[name] for name in e.regressors.values()]
        return left, np.column_stack([*columns, plan.hold * self.sums[-2]] if e.bias else columns)


def _solved(
    left: Complex, right: Complex, window: Complex, plan: RegressionPlan, projected: Complex
) -> tuple[Array, Array, Complex] | None:
    """Coefficients, their covariance and the residuals; None where they cannot be told apart.

    In two stages where `projected` is what instruments have moved of the right side (Söderström and Stoica 1983).
    """
    n, k = right.shape
    gram = (projected.conj().T @ projected).real
    size = np.sqrt(np.diag(gram))
    length = float(window[0].real)
    if length <= 0.0 or not np.all(size > 0.0):
        return None
    normal = gram / np.outer(size, size)
    lower = _factor(normal)
    if lower is None:
        return None
    inverse = np.linalg.inv(lower)
    inverse = inverse.T @ inverse
    values = inverse @ ((projected.conj().T @ left).real / size) / size
    residual = left - right @ values
    line = np.arange(n)
    lines = n * n * length * length / float(np.sum(np.abs(window[np.abs(line[:, None] - line)]) ** 2))
    freedom = 2.0 * lines - k
    if freedom <= LEAST_FREEDOM:
        return None
    near = np.maximum(0.0, 1.0 - np.abs(line[:, None] - line) / (plan.around + 1.0))
    scaled = projected / size
    # What the coefficients have taken of a line's two numbers, of which neighbours share some.
    taken = np.sum((scaled.conj() @ inverse * scaled).real, axis=1) * n / (2.0 * lines)
    left_over = np.maximum(LEAST_LEFT, 1.0 - taken)
    spectrum = near @ np.abs(residual) ** 2 / (near @ left_over) / length
    spectrum *= freedom / (freedom - 2.0)  # few numbers say their own size badly (Student's t)
    middle = scatter(scaled * np.sqrt(spectrum)[:, None], window, plan.first)
    return values, inverse @ middle @ inverse / np.outer(size, size), residual


def scatter(rows: Complex, window: Complex, first: int) -> Array:
    """Covariance of Re(sum over the lines of rows* v), where v is the transform of noise with a spectrum of one.

    Args:
        rows: (lines, unknowns).
        window: transform of the squared weights at multiples of the spacing.
        first: the first line, in such multiples.
    """
    line = np.arange(len(rows))
    apart, together = window[np.abs(line[:, None] - line)], window[line[:, None] + line + 2 * first]
    apart = np.where(line[:, None] >= line, apart, apart.conj())
    covariance: Array = 0.5 * (rows.conj().T @ apart @ rows + rows.conj().T @ together @ rows.conj()).real
    return covariance


def _factor(normal: Array) -> Array | None:
    """Lower Cholesky factor; None where a pivot says that a regressor is nearly a sum of others."""
    try:
        lower = np.asarray(np.linalg.cholesky(normal), dtype=np.float64)
    except np.linalg.LinAlgError:
        return None
    return lower if float(np.min(np.diag(lower)) ** 2) > LEAST_PIVOT else None
