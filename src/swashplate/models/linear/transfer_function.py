"""`TransferFunction`: gain, zeros, poles and a delay, with names; what its form may be and how it answers."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from swashplate.arrays import Array, Complex
from swashplate.errors import IdentificationError
from swashplate.models.linear import python_control

HIGHEST = 12
"""Order of a polynomial up to which a form is taken."""


@dataclass(frozen=True)
class Form:
    """What a transfer function is made of: K (zeros) e^(-tau s) / (s^integrators (poles)).

    A first-order factor is (s + a), a second-order one (s^2 + 2 zeta omega s + omega^2), where zeta above one is a pair
    of real roots.

    Attributes:
        zeros, poles: polynomial orders.
        integrators: poles at the origin (negative: zeros there).
        delay: whether it has one.
    """

    zeros: int
    poles: int
    integrators: int = 0
    delay: bool = True

    @property
    def zero_names(self) -> tuple[str, ...]:
        return _factor_names("zero", self.zeros)

    @property
    def pole_names(self) -> tuple[str, ...]:
        return _factor_names("pole", self.poles)

    @property
    def own_names(self) -> tuple[str, ...]:
        """What belongs to one response: gain, zeros and delay (poles may be shared)."""
        return ("K", *self.zero_names, *(("tau",) if self.delay else ()))

    @property
    def names(self) -> tuple[str, ...]:
        return (*self.own_names, *self.pole_names)

    @property
    def text(self) -> str:
        origin = (
            f"+{self.integrators}s" if self.integrators > 0 else f"-{-self.integrators}s" if self.integrators else ""
        )
        return f"{self.zeros}/{self.poles}{origin}{'' if self.delay else ' no delay'}"

    @staticmethod
    def parse(text: str) -> Form:
        """`"1/2"` (orders of zeros and poles), `"0/1+1s"` (one integrator), `"0/0"` (gain and delay), `"... no delay"`.

        More zeros than poles ("2/1") is a form over a band; it has no states and cannot be flown.

        Raises:
            IdentificationError: with examples.
        """
        match = re.fullmatch(r"(\d{1,2})/(\d{1,2})(?:([+-])(\d)s)?( no delay)?", text.strip())
        if match is None:
            raise IdentificationError(
                f"'{text}' is no form of a transfer function.",
                hint='Examples: "1/2" (one zero, two poles, delay), "0/1+1s" (an integrator), "0/2 no delay", "2/1".',
            )
        if max(int(match[1]), int(match[2])) > HIGHEST:
            raise IdentificationError(
                f"'{text}' is of an order above {HIGHEST}, which no response tells.", hint="Take a form of lower order."
            )
        origin = int(match[4] or 0) * (-1 if match[3] == "-" else 1)
        return Form(int(match[1]), int(match[2]), origin, not match[5])


USUAL = (
    Form(0, 0),
    Form(0, 0, 1),
    Form(0, 1),
    Form(0, 1, 1),
    Form(1, 1),
    Form(0, 2),
    Form(1, 2),
    Form(0, 2, 1),
    Form(2, 2),
    Form(1, 2, 1),
    Form(1, 3),
    Form(2, 3),
    Form(2, 4),
)
"""Structures worth trying on a flying thing, simplest first; "0/0" is the pure gain and delay of Bhandari et al."""


def _factor_names(role: str, order: int) -> tuple[str, ...]:
    names: list[str] = []
    for k in range(order // 2):
        number = k + 1 if order > 3 else ""
        names += [f"zeta_{role}{number}", f"omega_{role}{number}"]
    return (*names, f"{role}") if order % 2 else tuple(names)


def _factors(names: Sequence[str], values: Mapping[str, Any], s: Complex) -> tuple[Complex, dict[str, Complex]]:
    """The product of a polynomial's factors at s, and the derivative of its logarithm by each parameter."""
    product, slopes = np.ones_like(s), {}
    for name in names:
        if name.startswith("zeta_"):
            zeta, omega = values[name], values["omega_" + name[5:]]
            factor = s**2 + 2.0 * zeta * omega * s + omega**2
            slopes[name] = 2.0 * omega * s / factor
            slopes["omega_" + name[5:]] = (2.0 * zeta * s + 2.0 * omega) / factor
        elif not name.startswith("omega_"):
            factor = s + values[name]
            slopes[name] = 1.0 / factor
        else:
            continue
        product = product * factor
    return product, slopes


@dataclass(frozen=True)
class TransferFunction:
    """A form with numbers.

    Attributes:
        form: what it is made of.
        values: by name: K, tau [s], zero and pole [1/s], zeta_... [1], omega_... [rad/s].
        output, input: channels that it joins.
    """

    form: Form
    values: Mapping[str, float]
    output: str = "y"
    input: str = "u"

    def response(self, omega: Array) -> Complex:
        """H(j omega), shape (n,)."""
        return self.with_slopes(omega)[0]

    def with_slopes(self, omega: Array) -> tuple[Complex, dict[str, Complex]]:
        """H(j omega) and the derivatives of its logarithm by each parameter."""
        s: Complex = np.asarray(1j * np.asarray(omega), dtype=np.complex128)
        top, slopes = _factors(self.form.zero_names, self.values, s)
        bottom, down = _factors(self.form.pole_names, self.values, s)
        tau = self.values.get("tau", 0.0)
        h = self.values["K"] * top * np.exp(-tau * s) / (bottom * s**self.form.integrators)
        slopes |= {name: -slope for name, slope in down.items()}
        slopes["K"] = np.full(s.shape, 1.0 / self.values["K"], dtype=np.complex128)
        slopes["tau"] = -s
        return np.asarray(h, dtype=np.complex128), slopes

    @property
    def poles(self) -> Complex:
        """Roots of the denominator [1/s]."""
        return _with_origin(_roots(self.form.pole_names, self.values), self.form.integrators)

    @property
    def zeros(self) -> Complex:
        """Roots of the numerator [1/s]."""
        return _with_origin(_roots(self.form.zero_names, self.values), -self.form.integrators)

    @property
    def coefficients(self) -> tuple[Array, Array]:
        """Numerator and denominator in falling powers of s, without the delay."""
        top = self.values["K"] * np.real(np.atleast_1d(np.poly(self.zeros)))
        bottom = np.real(np.atleast_1d(np.poly(self.poles)))
        return np.asarray(top, dtype=np.float64), np.asarray(bottom, dtype=np.float64)

    def to_control(self, *, pade: int | None = None) -> Any:
        """As `control.TransferFunction`.

        Args:
            pade: order of the polynomials that stand for the delay `values["tau"]`; 0 leaves it out, None does so with
                a warning where there is one.

        Raises:
            SwashError: an order outside 0 to 12.
        """
        name = f"{self.output}/{self.input}"
        return python_control.transfer_function(*self.coefficients, delay=self.values["tau"], pade=pade, name=name)

    def __repr__(self) -> str:
        def side(names: Sequence[str]) -> str:
            parts = []
            for name in names:
                if name.startswith("zeta_"):
                    zeta, omega = self.values[name], self.values["omega_" + name[5:]]
                    parts.append(f"[zeta {zeta:.3g}, omega {omega:.4g} rad/s]")
                elif not name.startswith("omega_"):
                    parts.append(f"(s + {self.values[name]:.4g})")
            return " ".join(parts)

        k = self.form.integrators
        below = " ".join(part for part in (("s " * k).strip(), side(self.form.pole_names)) if part)
        above = " ".join(part for part in (("s " * -k).strip(), side(self.form.zero_names)) if part)
        delay = f" e^(-{self.values['tau']:.4g} s)" if self.form.delay and self.values["tau"] else ""
        return f"{self.output}/{self.input} = {self.values['K']:.4g} {above}{delay}" + (f" / {below}" if below else "")


class TransferFunctions(tuple[TransferFunction, ...]):
    """Functions of one input to several outputs, with the same poles."""

    __slots__ = ()

    def __new__(cls, functions: Iterable[TransferFunction]) -> Self:
        return super().__new__(cls, functions)

    @property
    def inputs(self) -> tuple[str, ...]:
        """The one input."""
        return tuple(dict.fromkeys(one.input for one in self))

    @property
    def outputs(self) -> tuple[str, ...]:
        """One a function."""
        return tuple(one.output for one in self)

    def response(self, omega: Array) -> Complex:
        """H(j omega) at frequencies [rad/s] with their delays, shape (n, n_outputs, 1)."""
        return np.stack([one.response(omega) for one in self], axis=1)[:, :, None]

    def eigenvalues(self) -> Complex:
        """The poles that they share [1/s], fastest first."""
        poles = self[0].poles
        return poles[np.argsort(-np.abs(poles), kind="stable")]

    def log_slopes(self, output: str, input: str, omega: Array, free: Sequence[str]) -> tuple[Complex, Complex]:
        """One response (n,) and the derivatives of its logarithm by named parameters, shape (n, n_free).

        Args:
            output, input: the pair. omega: [rad/s].
            free: parameters as a fit names them: what is of one response of several has its output behind ("K p").
        """
        function = next(one for one in self if (one.output, one.input) == (output, input))
        h, derivatives = function.with_slopes(omega)
        mine = function.form.own_names if len(self) > 1 else ()
        by_name = {f"{name} {output}" if name in mine else name: slope for name, slope in derivatives.items()}
        slopes = np.zeros((np.size(omega), len(free)), dtype=np.complex128)
        for k, name in enumerate(free):
            slopes[:, k] = by_name.get(name, 0.0)
        return h, slopes


def _with_origin(roots: Complex, count: int) -> Complex:
    """Roots and so many at zero."""
    return np.concatenate([roots, np.zeros(max(count, 0), dtype=np.complex128)])


def _roots(names: Sequence[str], values: Mapping[str, float]) -> Complex:
    roots: list[complex] = []
    for name in names:
        if name.startswith("zeta_"):
            zeta, omega = values[name], values["omega_" + name[5:]]
            roots += list(np.roots([1.0, 2.0 * zeta * omega, omega**2]))
        elif not name.startswith("omega_"):
            roots.append(-values[name])
    return np.array(roots, dtype=np.complex128)
