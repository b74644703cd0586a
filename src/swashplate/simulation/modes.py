"""Modes of a linear model."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Mode:
    """One real eigenvalue or one conjugate pair.

    Attributes:
        eigenvalue: with the positive imaginary part [1/s].
        frequency: its modulus, the natural frequency [rad/s].
        damping: damping ratio; 1 for a stable real mode, -1 for an unstable one, 0 at the origin.
        time_constant: -1 / real part [s]; negative where the mode grows, infinite where it does neither.
        states: the three states that take part most, and those that do so as much as the third, largest first and
            equal ones in the model's order, with their share (participation factors). At the origin, whose
            eigenvalues often repeat: all states of that subspace, in the model's order.
    """

    eigenvalue: complex
    frequency: float
    damping: float
    time_constant: float
    states: tuple[tuple[str, float], ...]
